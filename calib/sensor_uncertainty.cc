#include "calib/sensor_uncertainty.h"

#include <utility>

#include "calib/seen_boards.h"
#include "solvers/projection_uncertainty.h"
#include "solvers/sensor_chain.h"
#include "tracking/median.h"

namespace crumple {
namespace {

// The middle of a board, or of the frame that carries the LEDs, in the sensor's frame.
Eigen::Vector3d middle_mm(const ViewSummary& view, const CalibrationState& state) {
  if (!view.placement) return sensor_from_leds(state, view.sensor, view.station).pose.translation;
  const Pose sensor_from_board = sensor_from_board_pose(state, view.sensor, *view.placement, view.station);
  return sensor_from_board * board_centre(state.board_at(*view.placement));
}

// Median of a length of the middles of all that a sensor saw; none where it saw nothing.
template <typename Length>
std::optional<double> median_mm(std::size_t sensor, const BundleResult& bundle, Length length) {
  std::vector<double> lengths;
  for (const ViewSummary& view : bundle.views) {
    if (view.sensor == sensor) lengths.push_back(length(middle_mm(view, bundle.state)));
  }
  if (lengths.empty()) return std::nullopt;
  return median_of(std::move(lengths));
}

SensorUncertainty over_cells(const ProjectionUncertainty& uncertainty, const ImageCells& cells, double distance_mm) {
  SensorUncertainty result{distance_mm, {}};
  for (std::size_t cell = 0; cell < cells.cells.size(); ++cell) {
    const auto covariance = uncertainty.at_pixel(cells.centre_px(cell), distance_mm);
    result.sigma_px.push_back(covariance ? std::optional(worst_direction_sigma(*covariance)) : std::nullopt);
  }
  return result;
}

}  // namespace

std::vector<std::optional<SensorUncertainty>> sensor_uncertainties(const Calibration& calibration,
                                                                   const std::vector<ImageCells>& cells) {
  const Rig rig = calibrated_rig(calibration);
  std::vector<std::optional<SensorUncertainty>> all(rig.sensors.size());
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const auto distance = median_mm(s, calibration.bundle, [](const Eigen::Vector3d& middle) { return middle.norm(); });
    const auto uncertainty = ProjectionUncertainty::create(rig, s);
    if (distance && uncertainty) all[s] = over_cells(*uncertainty, cells[s], *distance);
  }
  return all;
}

std::vector<std::vector<SensorUncertainty>> sensor_uncertainty_maps(const Calibration& calibration,
                                                                    const std::vector<ImageCells>& cells,
                                                                    const std::vector<double>& distances_mm) {
  const Rig rig = calibrated_rig(calibration);
  std::vector<std::vector<SensorUncertainty>> all(rig.sensors.size());
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const auto uncertainty = ProjectionUncertainty::create(rig, s);
    if (!uncertainty) continue;
    for (const double distance_mm : distances_mm) all[s].push_back(over_cells(*uncertainty, cells[s], distance_mm));
  }
  return all;
}

std::optional<double> median_depth_mm(std::size_t sensor, const BundleResult& bundle) {
  return median_mm(sensor, bundle, [](const Eigen::Vector3d& middle) { return middle.z(); });
}

}  // namespace crumple
