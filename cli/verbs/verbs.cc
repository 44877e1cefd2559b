#include "cli/verbs/verbs.h"

namespace crumple {

std::vector<Verb> all_verbs() { return {patterns_verb(), calibrate_verb()}; }

}  // namespace crumple
