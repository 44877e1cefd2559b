// The recordings in hand_eye of the public data sets: two streams of poses each, zipped.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace crumple {

struct RealHandEye {
  std::string name;  // of the archive
  std::string hand;  // path inside of it
  std::string eye;
  double quick_look_mm;  // the scatter that the data's README states
};

inline const std::array<RealHandEye, 2> kRealHandEye{
    RealHandEye{"prime_sense_color_w_vicon_1", "prime_sense_1/2017-04-09-18-13-10_vicon_prime_sense.csv",
                "prime_sense_1/2017-04-09-18-13-10_W_camera_rgb_image_raw.csv", 7.9},
    RealHandEye{"robot_arm_w_color_camera_real",
                "robot_arm/robot_arm_complete_bag_color_and_ir_base_link_sr300_hinge.csv",
                "robot_arm/robot_arm_complete_bag_color_and_ir_target_ir.csv", 3.6}};

// Unpacks into `folder` and returns what the archive holds; none where the data set, or Debian's Python, is not there.
std::optional<std::filesystem::path> unpack(const RealHandEye& set, const std::filesystem::path& folder);

}  // namespace crumple
