#include "cli/pose_choice.h"

#include <numbers>

#include <fmt/format.h>

namespace crumple {
namespace {

double in_degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

}  // namespace

nlohmann::json choice_json(const PoseChoice& choice) {
  return {{"poses", choice.poses},
          {"near", choice.near},
          {"turn_deg", in_degrees(choice.turn_rad)},
          {"place_mm", choice.place_mm},
          {"to_other_deg", in_degrees(choice.to_other_rad)}};
}

std::string choice_text(const PoseChoice& choice) {
  return fmt::format(
      "1 of {} poses that explain the pixels, taken for being near {}: {:.0f} deg and {:.0f} mm from it, {:.0f} deg "
      "from the next",
      choice.poses, choice.near, in_degrees(choice.turn_rad), choice.place_mm, in_degrees(choice.to_other_rad));
}

}  // namespace crumple
