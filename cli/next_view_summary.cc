#include "cli/next_view_summary.h"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace crumple {
namespace {

using nlohmann::json;

int whole_degrees(double angle_rad) {
  return static_cast<int>(std::lround(std::abs(angle_rad) * 180 / std::numbers::pi));
}

// "in the middle", "towards the lower left".
std::string part_of_image(const ViewCandidate& view) {
  constexpr std::array<const char*, 3> rows{"upper", "", "lower"}, columns{"left", "", "right"};
  const std::string row = rows[static_cast<std::size_t>(view.row + 1)];
  const std::string column = columns[static_cast<std::size_t>(view.column + 1)];
  if (row.empty() && column.empty()) return "in the middle";
  if (column.empty()) return fmt::format("towards the {} edge", row);
  return fmt::format("towards the {}{}{}", row, row.empty() ? "" : " ", column);
}

std::string turn(const ViewCandidate& view) {
  if (view.about_vertical_rad != 0) {
    return fmt::format("turned {} degrees about its vertical, its right edge {}",
                       whole_degrees(view.about_vertical_rad), view.about_vertical_rad > 0 ? "nearer" : "farther");
  }
  if (view.about_horizontal_rad != 0) {
    return fmt::format("turned {} degrees about its horizontal, its lower edge {}",
                       whole_degrees(view.about_horizontal_rad), view.about_horizontal_rad > 0 ? "farther" : "nearer");
  }
  return view.like_station ? "" : "facing it";
}

std::string where(const ViewCandidate& view, const Calibration& calibration) {
  const CalibrationState& state = calibration.bundle.state;
  if (view.like_station) {
    const std::string turned = turn(view);
    return fmt::format("the probe alone, its LEDs {:.0f} mm before {}, {} of its image, {} it stood at {}",
                       view.distance_mm, state.rig.sensors[view.camera].name, part_of_image(view),
                       turned.empty() ? "as" : turned + ", from how", calibration.station_names[*view.like_station]);
  }
  std::string board = state.boards[*view.board].name;
  if (view.placement) {
    board =
        fmt::format("the probe before {} of {}", calibration.placement_names[*view.placement], board) + ", the board";
  }
  return fmt::format("{} {:.0f} mm before {}, {} of its image, {}", board, view.distance_mm,
                     state.rig.sensors[view.camera].name, part_of_image(view), turn(view));
}

std::string from_to(double before, double after, bool triangulated) {
  return fmt::format("from {:.3g} to {:.3g} {}", before, after, triangulated ? "mm" : "px");
}

}  // namespace

json next_views_summary(const NextViews& next, const Calibration& calibration) {
  const CalibrationState& state = calibration.bundle.state;
  json views = json::array();
  for (const auto& [view, before, after] : next.suggestions) {
    json entry{{"camera", state.rig.sensors[view.camera].name},
               {"distance_mm", view.distance_mm},
               {"column", view.column},
               {"row", view.row},
               {"about_vertical_rad", view.about_vertical_rad},
               {"about_horizontal_rad", view.about_horizontal_rad},
               {"before", before},
               {"after", after},
               {"words", where(view, calibration)}};
    if (view.board) entry["board"] = state.boards[*view.board].name;
    if (view.like_station) entry["like_station"] = calibration.station_names[*view.like_station];
    if (view.placement) entry["placement"] = calibration.placement_names[*view.placement];
    views.push_back(std::move(entry));
  }
  return {{"quantity", next.triangulated ? "point_mm" : "projection_px"}, {"now", next.now}, {"views", views}};
}

std::string next_views_text(const NextViews& next, const Calibration& calibration) {
  const char* quantity =
      next.triangulated ? "mean uncertainty in the measuring volume" : "mean uncertainty of a projection";
  std::string text = "next views:\n";
  for (const auto& [view, before, after] : next.suggestions) {
    text += fmt::format("  {}: lowers the {} {}\n", where(view, calibration), quantity,
                        from_to(before, after, next.triangulated));
  }
  if (next.suggestions.empty()) text += "  none of those considered would tell more\n";
  return text;
}

}  // namespace crumple
