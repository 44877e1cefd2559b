#include "calib/unseen_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace crumple {
namespace {

constexpr int kParts = 3;  // along each side
constexpr double kCounting = 0.25;
constexpr std::array<const char*, kParts * kParts> kPartNames{
    "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};

bool inside(const Eigen::Vector2d& pixel, const ImageSize& size) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= size.width_px - 0.5 &&
         pixel.y() <= size.height_px - 0.5;
}

bool counts(const Rig& rig, std::size_t s, const Eigen::Vector2d& pixel, double distance_mm) {
  const Sensor& sensor = rig.sensors[s];
  if (sensor.kind != SensorKind::projector) return true;
  const auto ray = sensor.lens.ray(pixel);
  if (!ray) return false;
  const Eigen::Vector3d point = sensor.sensor_from_mount.inverse() * (ray->normalized() * distance_mm);
  return std::any_of(rig.sensors.begin(), rig.sensors.end(), [&](const Sensor& other) {
    if (other.kind == SensorKind::projector || other.mount != sensor.mount) return false;
    const auto seen = other.lens.project(other.sensor_from_mount * point);
    return seen && inside(*seen, other.lens.size());
  });
}

struct Sum {
  std::size_t observations = 0;
  double squares_px2 = 0;
  double cells = 0;
  double uncounted = 0;

  void add(std::size_t seen, const std::optional<double>& sigma_px) {
    observations += seen;
    squares_px2 += sigma_px ? *sigma_px * *sigma_px : std::numeric_limits<double>::infinity();
    ++cells;
  }
  bool counts() const { return cells > kCounting * (cells + uncounted); }
  double rms_px() const { return std::sqrt(squares_px2 / std::max(1.0, cells)); }
};

}  // namespace

std::vector<UnseenParts> unseen_parts(const Rig& rig, const std::vector<ImageCells>& cells,
                                      const std::vector<std::optional<SensorUncertainty>>& uncertainties) {
  std::vector<UnseenParts> all;
  for (std::size_t s = 0; s < cells.size(); ++s) {
    if (!uncertainties[s]) continue;
    const ImageCells& of_sensor = cells[s];
    std::array<Sum, kParts * kParts> parts;
    Sum seen;
    for (std::size_t cell = 0; cell < of_sensor.cells.size(); ++cell) {
      const int at = static_cast<int>(cell);
      const int column = kParts * (at % of_sensor.columns) / of_sensor.columns;
      const int row = kParts * (at / of_sensor.columns) / of_sensor.rows;
      const std::size_t observations = of_sensor.cells[cell].observations;
      const auto& sigma_px = uncertainties[s]->sigma_px[cell];
      Sum& part = parts[static_cast<std::size_t>(kParts * row + column)];
      if (observations == 0 && !counts(rig, s, of_sensor.centre_px(cell), uncertainties[s]->distance_mm)) {
        ++part.uncounted;
        continue;
      }
      part.add(observations, sigma_px);
      if (observations > 0) seen.add(observations, sigma_px);
    }
    UnseenParts unseen{s, {}, 0, seen.rms_px()};
    for (std::size_t part = 0; part < parts.size(); ++part) {
      if (parts[part].observations > 0 || !parts[part].counts()) continue;
      unseen.parts.emplace_back(kPartNames[part]);
      unseen.sigma_px = std::max(unseen.sigma_px, parts[part].rms_px());
    }
    if (!unseen.parts.empty()) all.push_back(std::move(unseen));
  }
  return all;
}

}  // namespace crumple
