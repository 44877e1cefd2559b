#include "cli/difference_files.h"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/image_io.h"
#include "datasets/output_folder.h"
#include "datasets/residual_overlay.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

// The numbers of one point behind what it is.
std::string difference_columns(const AlignedDifference& d, int point) {
  const Eigen::VectorXd values = d.values.segment(d.dimension * point, d.dimension);
  return fmt::format("{},{},{}\n", fmt::join(values.begin(), values.end(), ","), d.sigma(point), d.sigmas(point));
}

std::string sensor_csv(const SensorDrift& sensor) {
  std::string text = "x_px,y_px,dx_px,dy_px,sigma_px,sigmas\n";
  for (int p = 0; p < sensor.projection.px.points(); ++p) {
    const Eigen::Vector2d& pixel = sensor.projection.pixels[static_cast<std::size_t>(p)];
    text += fmt::format("{},{},{}", pixel.x(), pixel.y(), difference_columns(sensor.projection.px, p));
  }
  return text;
}

std::string volume_csv(const VolumeDifference& volume) {
  std::string text = "x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,sigma_mm,sigmas\n";
  for (int p = 0; p < volume.mm.points(); ++p) {
    const Eigen::Vector3d& point = volume.points_mm[static_cast<std::size_t>(p)];
    text += fmt::format("{},{},{},{}", point.x(), point.y(), point.z(), difference_columns(volume.mm, p));
  }
  return text;
}

std::string leds_csv(const LedDifference& leds) {
  std::string text = "led,dx_mm,dy_mm,dz_mm,sigma_mm,sigmas\n";
  for (int p = 0; p < leds.mm.points(); ++p) {
    text += leds.leds[static_cast<std::size_t>(p)] + "," + difference_columns(leds.mm, p);
  }
  return text;
}

cv::Mat picture_of(const SensorDrift& sensor, double k) {
  const AlignedDifference& d = sensor.projection.px;
  std::vector<ResidualArrow> arrows;
  for (int p = 0; p < d.points(); ++p) {
    arrows.push_back(
        {sensor.projection.pixels[static_cast<std::size_t>(p)], d.values.segment<2>(2 * p), d.sigmas(p) <= k});
  }
  const ImageSize& size = sensor.size;
  const double typical_px = std::max(d.rms(), d.floor);
  const std::string where =
      std::isinf(sensor.distance_mm) ? "at infinity" : fmt::format("at {:.0f} mm", sensor.distance_mm);
  return residual_overlay(
      cv::Mat::zeros(size.height_px, size.width_px, CV_8U), arrows, enlargement_for(typical_px, size.width_px),
      typical_px, {fmt::format("{} {}: second rig minus first", sensor.sensor, where), "differences", "their RMS"});
}

}  // namespace

Expected<void> write_difference_files(const RigDifference& difference, const fs::path& folder) {
  for (const SensorDrift& sensor : difference.sensors) {
    if (auto done = write_file(folder / ("projection_" + sensor.sensor + ".csv"), sensor_csv(sensor)); !done)
      return done;
    if (auto done = write_png(folder / ("projection_" + sensor.sensor + ".png"), picture_of(sensor, difference.k));
        !done)
      return tl::unexpected(done.error());
  }
  for (const PairDrift& pair : difference.pairs) {
    const std::string name = "volume_" + pair.first + "+" + pair.second + ".csv";
    if (auto done = write_file(folder / name, volume_csv(pair.volume)); !done) return done;
  }
  if (!difference.leds) return {};
  const LedDifference& leds = difference.leds->leds;
  if (auto done = write_file(folder / "leds.csv", leds_csv(leds)); !done || !leds.of_measured) return done;
  return write_file(folder / "volume_leds.csv", volume_csv(*leds.of_measured));
}

}  // namespace crumple
