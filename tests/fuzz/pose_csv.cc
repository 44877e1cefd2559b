// Streams of poses as CSV.
#include "datasets/pose_csv.h"

#include <cmath>

#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto poses = parse_pose_csv(text_of(data, size), "fuzz.csv");
  if (!poses) return 0;
  for (const StampedPose& pose : *poses) {
    require(std::isfinite(pose.time_s) && pose.fixed_from_moving.translation.allFinite(), "numbers are finite");
    require(std::abs(pose.fixed_from_moving.rotation.norm() - 1) < 1e-9, "quaternions have unit length");
  }
  const auto stream = PoseStream::create(*poses);
  if (stream)
    require(stream->at(stream->first_s()).has_value() || stream->poses().size() > 2, "it starts at its start");
  return 0;
}
