// The verbs, in the order of `crumple help`. To add one: cli/verbs/NAME.cc, a line here and one in verbs.cc.
#pragma once

#include <vector>

#include "cli/verb.h"

namespace crumple {

Verb patterns_verb();
Verb simulate_verb();
Verb check_verb();
Verb calibrate_verb();
Verb track_verb();
Verb reconstruct_verb();
Verb measure_verb();
Verb diff_verb();
Verb export_verb();
Verb import_verb();

std::vector<Verb> all_verbs();

}  // namespace crumple
