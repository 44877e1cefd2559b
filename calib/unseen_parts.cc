#include "calib/unseen_parts.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/image_parts.h"

namespace crumple {
namespace {

constexpr double kMatteringShare = 0.25;

// Whether a camera beside the projector sees the point that its pixel lights.
bool seen_by_a_camera(const Rig& rig, const Sensor& projector, const Eigen::Vector2d& pixel, double distance_mm) {
  const auto ray = projector.lens.ray(pixel);
  if (!ray) return false;
  const Eigen::Vector3d point = projector.sensor_from_mount.inverse() * (ray->normalized() * distance_mm);
  return std::any_of(rig.sensors.begin(), rig.sensors.end(), [&](const Sensor& camera) {
    if (camera.kind == SensorKind::projector || camera.mount != projector.mount) return false;
    const auto seen = camera.lens.project(camera.sensor_from_mount * point);
    return seen && camera.lens.size().contains(*seen);
  });
}

struct CellSum {
  double observations = 0;
  double squares_px2 = 0;
  double mattering = 0;
  double cells = 0;

  double rms_px() const { return std::sqrt(squares_px2 / std::max(1.0, mattering)); }
};

}  // namespace

std::vector<UnseenPart> unseen_parts(const Rig& rig, const std::vector<ImageCells>& cells,
                                     const std::vector<std::optional<SensorUncertainty>>& uncertainties) {
  std::vector<UnseenPart> unseen;
  for (std::size_t s = 0; s < cells.size(); ++s) {
    if (!uncertainties[s]) continue;
    const ImageCells& of_sensor = cells[s];
    std::array<CellSum, kImageThirds * kImageThirds> parts;
    CellSum seen;
    for (std::size_t cell = 0; cell < of_sensor.cells.size(); ++cell) {
      const int at = static_cast<int>(cell);
      const int column = kImageThirds * (at % of_sensor.columns) / of_sensor.columns;
      const int row = kImageThirds * (at / of_sensor.columns) / of_sensor.rows;
      CellSum& part = parts[static_cast<std::size_t>(kImageThirds * row + column)];
      const auto observations = static_cast<double>(of_sensor.cells[cell].observations);
      ++part.cells;
      part.observations += observations;
      const std::optional<double>& sigma_px = uncertainties[s]->sigma_px[cell];
      if (!sigma_px) continue;
      const Eigen::Vector2d pixel = of_sensor.centre_px(cell);
      const bool is_projector = rig.sensors[s].kind == SensorKind::projector;
      if (is_projector && !seen_by_a_camera(rig, rig.sensors[s], pixel, uncertainties[s]->distance_mm)) continue;
      // Of a part that is named no cell holds an observation.
      CellSum& sum = observations > 0 ? seen : part;
      ++sum.mattering;
      sum.squares_px2 += *sigma_px * *sigma_px;
    }
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const CellSum& part = parts[p];
      if (part.observations > 0 || !(part.mattering >= kMatteringShare * part.cells) || part.mattering == 0) continue;
      unseen.push_back({s, kImagePartNames[p], part.rms_px(), seen.rms_px()});
    }
  }
  return unseen;
}

}  // namespace crumple
