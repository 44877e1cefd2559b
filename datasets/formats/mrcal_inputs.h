// The problem a rig's cameras are the solution of, as mrcal's optimization_inputs (formats/mrcal_rig.h).
#pragma once

#include <string>

#include "datasets/formats/rig_format.h"
#include "solvers/expected.h"

namespace crumple {

// base85 of an .npz with the arguments of mrcal.optimize(), the cameras in the rig's order. The error says what about
// the rig keeps mrcal from having it as a problem of its own.
Expected<std::string> mrcal_inputs(const RigToExport& source);

}  // namespace crumple
