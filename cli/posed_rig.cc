#include "cli/posed_rig.h"

#include <cassert>

#include <fmt/format.h>

#include "cli/flags.h"
#include "cli/rig_check_text.h"

namespace crumple {

namespace {

void test_stations(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations,
                   PosedRig& result) {
  result.misfits = misfitting_stations(rig, stations, result.noisier);
  for (const MisfittingStation& station : result.misfits) {
    result.document["misfits"].push_back({{"station", station.name},
                                          {"chi_square", station.misfit.chi_square},
                                          {"redundancy", station.misfit.redundancy},
                                          {"probability", station.misfit.probability}});
    result.text += fmt::format(
        "not to be trusted: station {}, whose LEDs contradict each other by more than noise and rig allow (chi-square "
        "{:.1f} of {}): look at its trackers' images, or leave it out\n",
        station.name, station.misfit.chi_square, station.misfit.redundancy);
  }
}

}  // namespace

Matrix6d restated_covariance(const Rig& rig, const Constellation& where, const NoiseFactors& noisier) {
  if (noisier.empty()) return where.pose.covariance;
  const auto covariance = pose_covariance(rig, used_readings(rig, where), where.pose.world_from_probe, noisier);
  assert(covariance && "the same readings determined the pose");
  return *covariance;
}

PosedRig posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations) {
  const auto check = check_posed_rig(rig, stations, thread_count());
  if (!check) {
    const std::string& reason = check.error().message;
    return {true, {{"not_checked", reason}}, fmt::format("whether the rig still holds was not tested: {}\n", reason)};
  }
  PosedRig result{check->valid(), rig_check_json(*check), unexplained_text(*check), {}, check->noisier};
  if (!check->noisier.empty()) result.text += "the stations' uncertainty is by what they scatter now\n";
  if (check->moved) {
    result.text += fmt::format(
        "not to be trusted: {}: leave it out from there on (`exclude` in capture.yaml), or calibrate with it as two "
        "cameras, the second with `lens_of` and its `stations`\n",
        check->moved->what);
  }
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
  // What changed makes the stations' LEDs contradict each other too.
  if (result.holds) test_stations(rig, stations, result);
  return result;
}

}  // namespace crumple
