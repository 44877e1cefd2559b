#include "cli/posed_rig.h"

#include <fmt/format.h>

#include "cli/flags.h"
#include "cli/rig_check_text.h"

namespace crumple {

PosedRig posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations) {
  const auto check = check_posed_rig(rig, stations, thread_count());
  if (!check) {
    const std::string& reason = check.error().message;
    return {true, {{"not_checked", reason}}, fmt::format("whether the rig still holds was not tested: {}\n", reason)};
  }
  PosedRig result{check->valid(), rig_check_json(*check), unexplained_text(*check)};
  for (const PartChange& change : check->changed) {
    const PartCheck& part = check->parts[change.part];
    result.text +=
        fmt::format("the rig no longer holds: {} changed by {} since it was calibrated (chi-square {:.1f} of {}",
                    part.name, part.how_far, part.gain, part.degrees);
    for (const std::size_t other : change.or_else) {
      result.text += fmt::format("; or else {} by {}", check->parts[other].name, check->parts[other].how_far);
    }
    result.text += "): calibrate again, `crumple calibrate --start` does with few stations\n";
  }
  return result;
}

}  // namespace crumple
