#include "datasets/calibration_record.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/output_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

Expected<void> check_corners(const CalibrationRecord& record, const std::string& file_name) {
  const std::vector<BoardPlacement>& placements = record.placements.placements;
  for (const RecordedCorners& view : record.corners) {
    const auto is_it = [&](const BoardPlacement& placement) { return placement.name == view.placement; };
    const auto placement = std::find_if(placements.begin(), placements.end(), is_it);
    if (placement == placements.end()) {
      return fail(fmt::format("{}: placement {} is not in placements.yaml", file_name, view.placement));
    }
    const Target& target = record.placements.boards[placement->board].target;
    const int points = board_of(target).point_count();
    const auto [lowest, highest] = std::minmax_element(view.corners.begin(), view.corners.end());
    if (*lowest < 0 || *highest >= points) {
      return fail(
          fmt::format("{}: placement {} has points beyond the {} of its board", file_name, view.placement, points));
    }
  }
  return {};
}

}  // namespace

Expected<std::optional<CalibrationRecord>> read_calibration_record(const fs::path& rig_folder) {
  const fs::path placements_file = rig_folder / "placements.yaml";
  if (!fs::exists(placements_file)) return std::optional<CalibrationRecord>();
  const auto placements_text = read_file(placements_file);
  if (!placements_text) return tl::unexpected(placements_text.error());
  auto placements = parse_placements(*placements_text, placements_file.string());
  if (!placements) return tl::unexpected(placements.error());
  const fs::path residuals_file = rig_folder / "residuals.csv";
  const auto residuals_text = read_file(residuals_file);
  if (!residuals_text) return tl::unexpected(residuals_text.error());
  auto corners = parse_recorded_corners(*residuals_text, residuals_file.string());
  if (!corners) return tl::unexpected(corners.error());
  CalibrationRecord record{std::move(*placements), std::move(*corners)};
  if (auto sound = check_corners(record, residuals_file.string()); !sound) return tl::unexpected(sound.error());
  return record;
}

}  // namespace crumple
