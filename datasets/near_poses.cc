#include "datasets/near_poses.h"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "datasets/stations_file.h"

namespace crumple {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kMostTurn_rad = 1 * kDegree;  // of a tracker, as it is found again
constexpr double kMostShift_mm = 30;

const Sensor* first_tracker(const Rig& rig) {
  const auto found = std::find_if(rig.sensors.begin(), rig.sensors.end(),
                                  [](const Sensor& sensor) { return sensor.mount == Mount::world; });
  return found == rig.sensors.end() ? nullptr : &*found;
}

// Fails where two rigs have different world frames. Tells how many trackers beside the first, whose frame it is, say
// that they have the same.
Expected<int> check_frame(const std::filesystem::path& file, const Rig& there, const Rig& here) {
  const std::string advice = "its poses are in another frame than those of --rig: state turns in the latter";
  const Sensor *const first_there = first_tracker(there), *const first_here = first_tracker(here);
  if (first_here == nullptr) return 0;
  if (first_there == nullptr || first_there->name != first_here->name) {
    return fail(fmt::format("--near: {}: the first tracker of its rig is {}, not {}, so {}", file.string(),
                            first_there == nullptr ? "none" : first_there->name, first_here->name, advice));
  }
  int compared = 0;
  for (const Sensor& tracker : here.sensors) {
    const auto again = there.find(tracker.name);
    if (tracker.mount != Mount::world || &tracker == first_here || !again) continue;
    if (there.sensors[*again].mount != Mount::world) continue;
    const Pose before = there.sensors[*again].sensor_from_mount.inverse(), now = tracker.sensor_from_mount.inverse();
    const double turn_rad = before.rotation.angularDistance(now.rotation);
    const double shift_mm = (before.translation - now.translation).norm();
    if (turn_rad > kMostTurn_rad || shift_mm > kMostShift_mm) {
      return fail(
          fmt::format("--near: {}: {} stands {:.1f} deg and {:.0f} mm from where it is in --rig, seen from {}, "
                      "so trackers were moved and {}",
                      file.string(), tracker.name, turn_rad / kDegree, shift_mm, first_here->name, advice));
    }
    ++compared;
  }
  return compared;
}

}  // namespace

Expected<NearPoses> NearPoses::create(const std::string& statement, const Rig& rig) {
  NearPoses near;
  near.previous_ = statement == "previous";
  if (statement.empty() || near.previous_) return near;
  const std::filesystem::path named = statement;
  near.file_ = std::filesystem::is_directory(named) ? named / "stations.yaml" : named;
  auto stated = read_posed_stations(*near.file_);
  if (!stated) return tl::unexpected(stated.error());
  near.stated_ = std::move(*stated);
  const auto earlier = read_rig_of_stations(*near.file_);
  if (!earlier) return tl::unexpected(earlier.error());
  if (!*earlier) {
    near.unchecked_ = "no run's rig is beside it";
    return near;
  }
  const auto compared = check_frame(*near.file_, **earlier, rig);
  if (!compared) return tl::unexpected(compared.error());
  if (*compared == 0) near.unchecked_ = "no second tracker shows whether the first was moved";
  return near;
}

std::optional<NearPose> NearPoses::at(const std::string& station) const {
  if (previous_) return last_;
  const auto found =
      std::find_if(stated_.begin(), stated_.end(), [&](const PosedStation& s) { return s.name == station; });
  if (found == stated_.end()) return std::nullopt;
  const std::string unchecked =
      unchecked_.empty() ? "" : fmt::format(" (not known to be in this frame: {})", unchecked_);
  return NearPose{found->world_from_probe, fmt::format("{} of {}{}", station, file_->string(), unchecked)};
}

Expected<StationPose> NearPoses::pose(const Capture& capture, const Rig& rig, const std::string& station) {
  auto found = station_pose(capture, rig, station, PoseMethod::pixels, at(station));
  if (found) posed(station, *found);
  return found;
}

void NearPoses::posed(const std::string& station, const StationPose& where) {
  const ProbePose& pose = where.constellation.pose;
  if (previous_ && !pose.choice) last_ = NearPose{pose.world_from_probe, "station " + station};
}

}  // namespace crumple
