#include "solvers/lens.h"

#include <cassert>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "solvers/opencv_model.h"

extern "C" {
#include <mrcal/mrcal.h>
}

namespace crumple {

struct Lens::Model {
  mrcal_lensmodel_t mrcal;
};

namespace {

constexpr double kRayTolerance_px = 1e-6;
constexpr int kRayIterations = 50;

bool supported(const mrcal_lensmodel_t& model) {
  switch (model.type) {
    case MRCAL_LENSMODEL_PINHOLE:
    case MRCAL_LENSMODEL_OPENCV4:
    case MRCAL_LENSMODEL_OPENCV5:
    case MRCAL_LENSMODEL_OPENCV8:
      return true;
    default:
      return false;
  }
}

Expected<mrcal_lensmodel_t> parse_model(const std::string& name) {
  mrcal_lensmodel_t model;
  if (!mrcal_lensmodel_from_name(&model, name.c_str()) || !supported(model)) {
    return fail(
        fmt::format("unknown lens model '{}': use LENSMODEL_PINHOLE, LENSMODEL_OPENCV4, LENSMODEL_OPENCV5 or "
                    "LENSMODEL_OPENCV8",
                    name));
  }
  return model;
}

}  // namespace

Lens::Lens(std::string model, ImageSize size, std::shared_ptr<const Model> shared)
    : model_(std::move(model)), size_(size), shared_(std::move(shared)) {}

Expected<Lens> Lens::create(const std::string& model, ImageSize size, std::vector<double> parameters) {
  const auto parsed = parse_model(model);
  if (!parsed) return tl::unexpected(parsed.error());
  const int count = mrcal_lensmodel_num_params(&*parsed);
  if (static_cast<int>(parameters.size()) != count) {
    return fail(fmt::format("{} takes {} parameters, not {}", model, count, parameters.size()));
  }
  for (const double p : parameters) {
    if (!std::isfinite(p)) return fail(fmt::format("{}: a parameter is not a finite number", model));
  }
  if (parameters[0] <= 0 || parameters[1] <= 0) return fail(fmt::format("{}: focal lengths must be positive", model));
  if (size.width_px <= 0 || size.height_px <= 0) return fail(fmt::format("{}: the image size must be positive", model));
  Lens lens(model, size, std::make_shared<const Model>(Model{*parsed}));
  lens.parameters_ = std::move(parameters);
  return lens;
}

Expected<Lens> Lens::undistorted(const std::string& model, ImageSize size, double focal_x_px, double focal_y_px,
                                 Eigen::Vector2d principal_point_px) {
  const auto parsed = parse_model(model);
  if (!parsed) return tl::unexpected(parsed.error());
  std::vector<double> parameters(static_cast<std::size_t>(mrcal_lensmodel_num_params(&*parsed)), 0.0);
  parameters[0] = focal_x_px;
  parameters[1] = focal_y_px;
  parameters[2] = principal_point_px.x();
  parameters[3] = principal_point_px.y();
  return create(model, size, std::move(parameters));
}

Lens Lens::with_parameters(std::vector<double> parameters) const {
  assert(parameters.size() == parameters_.size());
  Lens lens = *this;
  lens.parameters_ = std::move(parameters);
  return lens;
}

Eigen::Vector2d Lens::project(const Eigen::Vector3d& point) const {
  return project_opencv(parameters_.data(), parameter_count(), point);
}

Projection Lens::project_with_gradients(const Eigen::Vector3d& point) const {
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> d_parameters(2, parameter_count());
  Projection projection;
  projection.pixel =
      project_into(point, projection.d_point, d_parameters.data(), d_parameters.data() + parameter_count());
  projection.d_parameters = d_parameters;
  return projection;
}

Eigen::Vector2d Lens::project_into(const Eigen::Vector3d& point, Matrix2x3d& d_point, double* d_u, double* d_v) const {
  const OpencvProjection projection =
      project_opencv_with_gradients(parameters_.data(), parameter_count(), point, d_u, d_v);
  d_point = projection.d_point;
  return projection.pixel;
}

// Newton's method on the projection, from the undistorted ray; libmrcal's own inverse is an order slower and gives no
// sign of failure.
std::optional<Eigen::Vector3d> Lens::ray(const Eigen::Vector2d& pixel) const {
  Eigen::Vector3d v((pixel.x() - parameters_[2]) / parameters_[0], (pixel.y() - parameters_[3]) / parameters_[1], 1);
  for (int i = 0; i < kRayIterations; ++i) {
    const OpencvProjection at =
        project_opencv_with_gradients(parameters_.data(), parameter_count(), v, nullptr, nullptr);
    const Eigen::Vector2d error = at.pixel - pixel;
    if (!error.allFinite()) return std::nullopt;
    const Eigen::Matrix2d d = at.d_point.leftCols<2>();
    // Past the fold of the distortion the image is mirrored: such a root is not the lens's ray.
    if (d.determinant() <= 0) return std::nullopt;
    const Eigen::Vector2d step = d.inverse() * error;
    v.head<2>() -= step;
    if (step.norm() * std::max(parameters_[0], parameters_[1]) < 1e-11 * (1 + pixel.norm())) return v;
  }
  const bool found = v.allFinite() && (project(v) - pixel).norm() < kRayTolerance_px;
  return found ? std::optional(v) : std::nullopt;
}

std::optional<Ray> Lens::ray_with_gradients(const Eigen::Vector2d& pixel) const {
  const auto direction = ray(pixel);
  if (!direction) return std::nullopt;
  const Projection projection = project_with_gradients(*direction);
  const Eigen::Matrix2d d_xy_d_pixel = projection.d_point.leftCols<2>().inverse();
  Ray result;
  result.direction = *direction;
  result.d_parameters.setZero(3, parameter_count());
  result.d_parameters.topRows<2>() = -d_xy_d_pixel * projection.d_parameters;
  result.d_pixel.setZero();
  result.d_pixel.topRows<2>() = d_xy_d_pixel;
  return result;
}

std::vector<std::string> lens_parameter_names(const std::string& model) {
  const auto parsed = parse_model(model);
  assert(parsed);
  static const char* const names[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  return {names, names + mrcal_lensmodel_num_params(&*parsed)};
}

RayTable::RayTable(const Lens& lens) : width_px_(lens.size().width_px) {
  const auto [width, height] = lens.size();
  const double none = std::numeric_limits<double>::quiet_NaN();
  rays_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto ray = lens.ray({x, y});
      rays_.emplace_back(ray ? ray->head<2>() : Eigen::Vector2d(none, none));
    }
  }
}

bool RayTable::has(int x, int y) const { return std::isfinite(rays_[index(x, y)].x()); }

Eigen::Vector3d RayTable::at(int x, int y) const { return rays_[index(x, y)].homogeneous(); }

std::size_t RayTable::index(int x, int y) const {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(x);
}

}  // namespace crumple
