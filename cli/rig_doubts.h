// What its calibration said against a rig, where the rig is used.
#pragma once

#include "cli/verb.h"
#include "solvers/rig.h"

namespace crumple {

// Puts it first in the text, and into the document as `rig_verdict`; exit code 4 where nobody is to use the rig.
// Nothing where nothing was said.
void tell_doubts(const Rig& rig, VerbResult& result);

}  // namespace crumple
