#include "recon/surface_patches.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "recon/triangulate.h"

namespace crumple {
namespace {

// s = value + slopes . (pixel - node), by least squares.
struct CoordinatePlane {
  double value_px = 0;
  Eigen::Vector2d slopes = Eigen::Vector2d::Zero();
};

std::optional<CoordinatePlane> fit_coordinates(const StripeCoordinates& coordinates, int x, int y,
                                               const PatchOptions& options) {
  const int r = options.radius_px, width = 2 * r + 1;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0, variances = 0;
  int count = 0;
  for (int dy = -r; dy <= r; ++dy) {
    for (int dx = -r; dx <= r; ++dx) {
      const double sigma = coordinates.sigma_px.at<float>(y + dy, x + dx);
      if (sigma <= 0) continue;
      const Eigen::Vector3d row(1, dx, dy);
      const double s = coordinates.coordinate_px.at<double>(y + dy, x + dx);
      information += row * row.transpose();
      right += row * s;
      squares += s * s;
      variances += sigma * sigma;
      ++count;
    }
  }
  if (count < options.least_filled * width * width) return std::nullopt;
  const Eigen::Vector3d plane = information.ldlt().solve(right);
  const double scatter = std::max(squares - plane.dot(right), 0.0) / (count - 3);
  if (scatter > options.gate * options.gate * variances / count) return std::nullopt;
  return CoordinatePlane{plane[0], plane.tail<2>()};
}

}  // namespace

std::vector<SurfacePatch> surface_patches(const StationGeometry& geometry, const StripeOrientation& orientation,
                                          const StripeCoordinates& coordinates, const PatchOptions& options) {
  const StripeTriangulator triangulator(geometry.projector, geometry.proj_from_cam, orientation.normal());
  const int r = options.radius_px;
  const cv::Size size = coordinates.sigma_px.size();
  std::vector<SurfacePatch> patches;
  const auto point = [&](int x, int y, double coordinate_px) -> std::optional<Eigen::Vector3d> {
    if (!geometry.rays.has(x, y)) return std::nullopt;
    const auto met = triangulator(geometry.rays.at(x, y), coordinate_px);
    if (!met) return std::nullopt;
    return met->depth_mm * geometry.rays.at(x, y);
  };
  for (int y = r; y + r < size.height; y += options.step_px) {
    for (int x = r; x + r < size.width; x += options.step_px) {
      const auto plane = fit_coordinates(coordinates, x, y, options);
      if (!plane) continue;
      const auto middle = point(x, y, plane->value_px);
      const auto left = point(x - r, y, plane->value_px - r * plane->slopes.x());
      const auto right = point(x + r, y, plane->value_px + r * plane->slopes.x());
      const auto above = point(x, y - r, plane->value_px - r * plane->slopes.y());
      const auto below = point(x, y + r, plane->value_px + r * plane->slopes.y());
      if (!middle || !left || !right || !above || !below) continue;
      Eigen::Vector3d normal = (*right - *left).cross(*below - *above).normalized();
      if (normal.dot(*middle) > 0) normal = -normal;
      patches.push_back({Eigen::Vector2d(x, y), plane->value_px, geometry.probe_from_cam * *middle,
                         geometry.probe_from_cam.rotation * normal});
    }
  }
  return patches;
}

std::optional<std::size_t> best_orientation(const std::vector<OrientationReport>& orientations) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < orientations.size(); ++i) {
    if (!orientations[i].used) continue;
    if (!best || orientations[i].sensitivity_px_per_mm > orientations[*best].sensitivity_px_per_mm) best = i;
  }
  return best;
}

}  // namespace crumple
