#include "cli/pose_flags.h"

#include <fmt/format.h>
#include <gflags/gflags.h>

DEFINE_string(pose, "pixels",
              "how a tracked probe is posed: pixels (of all LEDs at once) or markers (triangulated, then fitted)");
DEFINE_string(near, "",
              "how the probe was turned, roughly, where its LEDs leave several poses: a stations.yaml with poses by "
              "station, or the folder of the run that wrote one, no tracker having been moved since; or previous: as "
              "at the last station before that its own LEDs pose");

namespace crumple {

Expected<PoseMethod> pose_method() {
  if (FLAGS_pose == "pixels") return PoseMethod::pixels;
  if (FLAGS_pose != "markers") return fail(fmt::format("--pose={} is neither pixels nor markers.", FLAGS_pose));
  if (!FLAGS_near.empty()) return fail("--near wants --pose=pixels: markers leave one pose or none");
  return PoseMethod::markers;
}

}  // namespace crumple
