// Poses as CSV: streams, and lists, which every stream is too.
#include "datasets/pose_csv.h"

#include <cmath>

#include "tests/fuzz/input.h"

namespace {

void require_sound(const crumple::Pose& pose) {
  crumple::require(pose.translation.allFinite(), "numbers are finite");
  crumple::require(std::abs(pose.rotation.norm() - 1) < 1e-9, "quaternions have unit length");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto list = parse_pose_list(text_of(data, size), "fuzz.csv");
  if (!list) return 0;
  for (const Pose& pose : *list) require_sound(pose);
  const auto poses = parse_pose_csv(text_of(data, size), "fuzz.csv");
  if (!poses) return 0;
  require(poses->size() == list->size(), "a stream has as many poses as the list");
  for (const StampedPose& pose : *poses) {
    require(std::isfinite(pose.time_s), "numbers are finite");
    require_sound(pose.fixed_from_moving);
  }
  const auto stream = PoseStream::create(*poses);
  if (stream)
    require(stream->at(stream->first_s()).has_value() || stream->poses().size() > 2, "it starts at its start");
  return 0;
}
