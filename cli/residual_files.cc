#include "cli/residual_files.h"

#include <map>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "datasets/image_io.h"
#include "datasets/output_folder.h"
#include "datasets/placements_file.h"
#include "datasets/residual_overlay.h"
#include "datasets/residuals_file.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

// By station and camera: several boards of a station are in one image.
using Arrows = std::map<std::pair<std::string, std::size_t>, std::vector<ResidualArrow>>;

void add_arrows(const ViewSummary& view, const std::vector<Eigen::Vector2d>& pixels,
                std::vector<ResidualArrow>& arrows) {
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    arrows.push_back({pixels[i], view.residuals_px.segment<2>(2 * static_cast<Eigen::Index>(i)), view.inlier[i] != 0});
  }
}

// Corners and projected features; stripes have one coordinate, and it is the projector's.
Arrows arrows_of(const CalibrationInput& input, const Calibration& calibration) {
  const Observations& observations = input.data.observations;
  const std::vector<ViewSummary>& views = calibration.bundle.views;
  Arrows arrows;
  for (std::size_t v = 0; v < observations.corners.size(); ++v) {
    const CornerView& seen = observations.corners[v];
    add_arrows(views[v], seen.pixels, arrows[{input.corner_stations[v], seen.sensor}]);
  }
  const std::size_t first_feature = observations.corners.size() + observations.stripes.size();
  for (std::size_t v = 0; v < observations.features.size(); ++v) {
    const FeatureView& seen = observations.features[v];
    add_arrows(views[first_feature + v], seen.camera_pixels, arrows[{input.feature_stations[v], seen.camera}]);
  }
  return arrows;
}

double corner_sigma_px(const Calibration& calibration, std::size_t sensor) {
  for (const GroupSummary& group : calibration.bundle.groups) {
    if (group.sensor == sensor && group.kind == View::Kind::corners) return group.sigma_px;
  }
  return 0;
}

Expected<void> write_picture(const Capture& capture, const Calibration& calibration, const std::string& station,
                             std::size_t camera, const std::vector<ResidualArrow>& arrows, const fs::path& folder) {
  const Sensor& sensor = calibration.bundle.state.rig.sensors[camera];
  const auto image = read_board_image(capture, sensor.name, station);
  if (!image) return tl::unexpected(image.error());
  const double sigma_px = corner_sigma_px(calibration, camera);
  const cv::Mat picture =
      residual_overlay(*image, arrows, enlargement_for(sigma_px, image->cols), sigma_px,
                       {fmt::format("station {}, {}: predicted minus measured", station, sensor.name)});
  const auto written = write_png(folder / fmt::format("{}_{}.png", station, sensor.name), picture);
  if (!written) return tl::unexpected(written.error());
  return {};
}

}  // namespace

Expected<void> write_residual_files(const Capture& capture, const CalibrationInput& input,
                                    const Calibration& calibration, bool pictures, const fs::path& folder) {
  const std::string csv = residuals_csv(calibration, input.data.observations);
  if (auto done = write_file(folder / "residuals.csv", csv); !done) return done;
  const std::string placements = placements_yaml(placements_of(calibration, input.data.boards));
  if (auto done = write_file(folder / "placements.yaml", placements); !done || !pictures) return done;
  std::error_code failure;
  fs::create_directory(folder / "overlays", failure);
  if (failure) return fail(fmt::format("{} cannot be made: {}", (folder / "overlays").string(), failure.message()));
  for (const auto& [place, arrows] : arrows_of(input, calibration)) {
    const auto& [station, camera] = place;
    if (auto done = write_picture(capture, calibration, station, camera, arrows, folder / "overlays"); !done)
      return done;
  }
  return {};
}

}  // namespace crumple
