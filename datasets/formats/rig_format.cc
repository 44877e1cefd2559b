#include "datasets/formats/rig_format.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/formats/colmap_rig.h"
#include "datasets/formats/kalibr_rig.h"
#include "datasets/formats/mrcal_rig.h"
#include "datasets/formats/opencv_rig.h"
#include "datasets/formats/ros_rig.h"

namespace crumple {

const std::vector<RigFormat>& rig_formats() {
  static const std::vector<RigFormat> formats = {{"opencv", "", write_opencv_rig, read_opencv_rig},
                                                 {"kalibr", "m", write_kalibr_rig, read_kalibr_rig},
                                                 {"ros", "m", write_ros_rig, read_ros_rig},
                                                 {"colmap", "", write_colmap_rig, read_colmap_rig},
                                                 {"mrcal", "", write_mrcal_rig, read_mrcal_rig}};
  return formats;
}

Expected<RigFormat> rig_format(const std::string& name) {
  std::vector<std::string> names;
  for (const RigFormat& format : rig_formats()) {
    if (format.name == name) return format;
    names.push_back(format.name);
  }
  return fail(fmt::format("'{}' is not a format of rigs: use one of {}", name, fmt::join(names, ", ")));
}

Rig scaled(Rig rig, double factor) {
  for (Sensor& sensor : rig.sensors) sensor.sensor_from_mount.translation *= factor;
  return rig;
}

}  // namespace crumple
