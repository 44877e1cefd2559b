#include "cli/verbs/verbs.h"

namespace crumple {

std::vector<Verb> all_verbs() {
  return {patterns_verb(),    simulate_verb(), check_verb(), calibrate_verb(), track_verb(),
          reconstruct_verb(), measure_verb(),  diff_verb(),  export_verb(),    import_verb()};
}

}  // namespace crumple
