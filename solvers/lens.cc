#include "solvers/lens.h"

#include <algorithm>
#include <array>
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
constexpr int kRayIterations = 100;
constexpr int kStepHalvings = 40;
constexpr int kMostControlPoints = 10000;

bool valid_grid(const mrcal_LENSMODEL_SPLINED_STEREOGRAPHIC__config_t& grid) {
  return (grid.order == 2 || grid.order == 3) && grid.Nx > grid.order && grid.Ny > grid.order &&
         static_cast<long>(grid.Nx) * grid.Ny <= kMostControlPoints && grid.fov_x_deg > 0 && grid.fov_x_deg < 360;
}

bool supported(const mrcal_lensmodel_t& model) {
  switch (model.type) {
    case MRCAL_LENSMODEL_PINHOLE:
    case MRCAL_LENSMODEL_OPENCV4:
    case MRCAL_LENSMODEL_OPENCV5:
    case MRCAL_LENSMODEL_OPENCV8:
    case MRCAL_LENSMODEL_OPENCV12:
    case MRCAL_LENSMODEL_CAHVOR:
      return true;
    case MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC:
      return valid_grid(model.LENSMODEL_SPLINED_STEREOGRAPHIC__config);
    default:
      return false;
  }
}

bool is_opencv(const mrcal_lensmodel_t& model) {
  return model.type == MRCAL_LENSMODEL_PINHOLE || MRCAL_LENSMODEL_IS_OPENCV(model.type);
}

bool is_splined(const mrcal_lensmodel_t& model) { return model.type == MRCAL_LENSMODEL_SPLINED_STEREOGRAPHIC; }

Expected<mrcal_lensmodel_t> parse_model(const std::string& name) {
  mrcal_lensmodel_t model;
  std::array<char, 128> canonical{};
  // mrcal reads past what follows a configuration: only the name that it would write itself is taken.
  if (!mrcal_lensmodel_from_name(&model, name.c_str()) || !supported(model) ||
      !mrcal_lensmodel_name(canonical.data(), static_cast<int>(canonical.size()), &model) || name != canonical.data()) {
    return fail(fmt::format("unknown lens model '{}': use one of {}", name, lens_model_choices()));
  }
  return model;
}

SplineGrid grid_of(const mrcal_lensmodel_t& model) {
  const auto& config = model.LENSMODEL_SPLINED_STEREOGRAPHIC__config;
  SplineGrid grid{std::vector<double>(config.Nx), std::vector<double>(config.Ny)};
  mrcal_knots_for_splined_models(grid.x.data(), grid.y.data(), &model);
  return grid;
}

LensDomain domain_of(const mrcal_lensmodel_t& model, const std::vector<double>& parameters) {
  if (model.type == MRCAL_LENSMODEL_CAHVOR) return LensDomain::cahvor(parameters);
  if (!is_splined(model)) return LensDomain::opencv(parameters);
  const SplineGrid grid = grid_of(model);
  // A cubic piece wants the two control points on either side; a quadratic one those nearest to it.
  const bool cubic = model.LENSMODEL_SPLINED_STEREOGRAPHIC__config.order == 3;
  const double margin = (cubic ? 1 : 0.5) * (grid.x[1] - grid.x[0]);
  return LensDomain::stereographic({grid.x.front() + margin, grid.y.front() + margin},
                                   {grid.x.back() - margin, grid.y.back() - margin});
}

// The two numbers that stand for a direction while a ray is sought: its slopes, or its stereographic coordinates.
struct Direction {
  Eigen::Vector3d vector;
  Eigen::Matrix<double, 3, 2> d_chart;
};

Direction from_chart(bool stereographic, const Eigen::Vector2d& chart) {
  Direction direction;
  if (!stereographic) {
    direction.vector = chart.homogeneous();
    direction.d_chart << 1, 0, 0, 1, 0, 0;
    return direction;
  }
  const mrcal_point2_t q{.xy = {chart.x(), chart.y()}};
  const double unit[] = {1, 1, 0, 0};
  mrcal_point3_t v;
  mrcal_point2_t dv_dq[3];
  mrcal_unproject_stereographic(&v, dv_dq, &q, 1, unit);
  direction.vector << v.x, v.y, v.z;
  direction.d_chart << dv_dq[0].x, dv_dq[0].y, dv_dq[1].x, dv_dq[1].y, dv_dq[2].x, dv_dq[2].y;
  return direction;
}

std::vector<std::string> control_point_names(int columns, int rows) {
  std::vector<std::string> names;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      names.push_back(fmt::format("dux_{}_{}", column, row));
      names.push_back(fmt::format("duy_{}_{}", column, row));
    }
  }
  return names;
}

}  // namespace

Lens::Lens(std::string model, ImageSize size, std::shared_ptr<const Model> shared, std::vector<double> parameters,
           bool past_folds)
    : model_(std::move(model)),
      size_(size),
      parameters_(std::move(parameters)),
      shared_(std::move(shared)),
      past_folds_(past_folds),
      domain_(domain_of(shared_->mrcal, parameters_)),
      projected_(past_folds_ && is_opencv(shared_->mrcal) ? LensDomain::opencv_past_fold(parameters_) : domain_) {}

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
  return Lens(model, size, std::make_shared<const Model>(Model{*parsed}), std::move(parameters));
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

bool Lens::splined() const { return is_splined(shared_->mrcal); }

SplineGrid Lens::spline_grid() const { return splined() ? grid_of(shared_->mrcal) : SplineGrid{}; }

Lens Lens::with_parameters(std::vector<double> parameters) const {
  assert(parameters.size() == parameters_.size());
  return Lens(model_, size_, shared_, std::move(parameters), past_folds_);
}

Lens Lens::past_folds() const { return Lens(model_, size_, shared_, parameters_, true); }

Lens Lens::within_folds() const { return Lens(model_, size_, shared_, parameters_, false); }

std::optional<Eigen::Vector2d> Lens::project(const Eigen::Vector3d& point) const {
  if (!projected_.contains(point)) return std::nullopt;
  if (is_opencv(shared_->mrcal)) return project_opencv(parameters_.data(), parameter_count(), point);
  const mrcal_point3_t p{.xyz = {point.x(), point.y(), point.z()}};
  mrcal_point2_t q;
  mrcal_project(&q, nullptr, nullptr, &p, 1, &shared_->mrcal, parameters_.data());
  return Eigen::Vector2d(q.x, q.y);
}

std::optional<Projection> Lens::project_with_gradients(const Eigen::Vector3d& point) const {
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> d_parameters(2, parameter_count());
  Projection projection;
  if (!project_into(point, projection.pixel, projection.d_point, d_parameters.row(0).data(),
                    d_parameters.row(1).data())) {
    return std::nullopt;
  }
  projection.d_parameters = d_parameters;
  return projection;
}

bool Lens::project_into(const Eigen::Vector3d& point, Eigen::Vector2d& pixel, Matrix2x3d& d_point, double* d_u,
                        double* d_v) const {
  if (!projected_.contains(point)) return false;
  follow(point, pixel, d_point, d_u, d_v);
  return true;
}

void Lens::follow(const Eigen::Vector3d& point, Eigen::Vector2d& pixel, Matrix2x3d& d_point, double* d_u,
                  double* d_v) const {
  if (is_opencv(shared_->mrcal)) {
    const OpencvProjection at = project_opencv_with_gradients(parameters_.data(), parameter_count(), point, d_u, d_v);
    pixel = at.pixel;
    d_point = at.d_point;
    return;
  }
  const mrcal_point3_t p{.xyz = {point.x(), point.y(), point.z()}};
  mrcal_point2_t q;
  mrcal_point3_t dq_dp[2];
  std::vector<double> d_parameters(d_u != nullptr ? 2 * parameters_.size() : 0);
  mrcal_project(&q, dq_dp, d_u != nullptr ? d_parameters.data() : nullptr, &p, 1, &shared_->mrcal, parameters_.data());
  pixel << q.x, q.y;
  d_point << dq_dp[0].x, dq_dp[0].y, dq_dp[0].z, dq_dp[1].x, dq_dp[1].y, dq_dp[1].z;
  if (d_u != nullptr) {
    std::copy_n(d_parameters.data(), parameters_.size(), d_u);
    std::copy_n(d_parameters.data() + parameters_.size(), parameters_.size(), d_v);
  }
}

// Newton's method on the projection, from the undistorted ray, every step halved until it stays in the domain and comes
// closer; libmrcal's own inverse is an order slower and gives no sign of failure.
std::optional<Eigen::Vector3d> Lens::ray(const Eigen::Vector2d& pixel) const {
  const Eigen::Map<const Eigen::Vector2d> focal_px(parameters_.data()), centre_px(parameters_.data() + 2);
  const auto error_at = [&](const Direction& direction, Eigen::Vector2d& error, Matrix2x3d& d_direction) {
    if (!domain_.contains(direction.vector)) return false;
    follow(direction.vector, error, d_direction, nullptr, nullptr);
    error -= pixel;
    return error.allFinite();
  };
  Eigen::Vector2d chart = (pixel - centre_px).cwiseQuotient(focal_px);
  Direction direction = from_chart(splined(), chart);
  Eigen::Vector2d error;
  Matrix2x3d d_direction;
  // The undistorted ray may lie outside the domain of a lens that spreads the image: start further in.
  for (int i = 0; !error_at(direction, error, d_direction); ++i) {
    if (i == kStepHalvings) return std::nullopt;
    chart *= 0.7;
    direction = from_chart(splined(), chart);
  }
  double distance_px = error.norm();
  for (int i = 0, halvings = 0; i < kRayIterations && halvings < kStepHalvings; ++i) {
    const Eigen::Matrix2d d = d_direction * direction.d_chart;
    // Past the fold of the distortion the image is mirrored: such a root is not the lens's ray.
    if (!(d.determinant() > 0)) return std::nullopt;
    Eigen::Vector2d step = d.inverse() * error;
    const bool settled = step.cwiseProduct(focal_px).norm() < 1e-11 * (1 + pixel.norm());
    if (settled && distance_px < kRayTolerance_px) {
      direction = from_chart(splined(), chart - step);
      break;
    }
    for (halvings = 0; halvings < kStepHalvings; ++halvings, step *= 0.5) {
      const Direction tried = from_chart(splined(), chart - step);
      if (!error_at(tried, error, d_direction) || error.norm() >= distance_px) continue;
      chart -= step;
      direction = tried;
      distance_px = error.norm();
      break;
    }
  }
  if (!(distance_px < kRayTolerance_px)) return std::nullopt;
  const Eigen::Vector3d& v = direction.vector;
  return v.z() > 0 ? Eigen::Vector3d(v / v.z()) : v.normalized();
}

std::optional<Ray> Lens::ray_with_gradients(const Eigen::Vector2d& pixel) const {
  const auto direction = ray(pixel);
  const auto projection = direction ? project_with_gradients(*direction) : std::nullopt;
  if (!projection) return std::nullopt;
  // The directions in which the ray's vector can move: within its plane z = 1, or on the unit sphere.
  Eigen::Matrix<double, 3, 2> free = Eigen::Matrix<double, 3, 2>::Identity();
  if (direction->z() <= 0) {
    free.col(0) = direction->unitOrthogonal();
    free.col(1) = direction->cross(free.col(0));
  }
  Ray result;
  result.direction = *direction;
  result.d_pixel = free * (projection->d_point * free).inverse();
  result.d_parameters = -result.d_pixel * projection->d_parameters;
  return result;
}

std::vector<std::string> lens_parameter_names(const std::string& model) {
  const auto parsed = parse_model(model);
  if (!parsed) return {};
  std::vector<std::string> names{"fx", "fy", "cx", "cy"};
  std::vector<std::string> further{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"};
  if (parsed->type == MRCAL_LENSMODEL_CAHVOR) further = {"alpha", "beta", "r0", "r1", "r2"};
  if (is_splined(*parsed)) {
    const auto& grid = parsed->LENSMODEL_SPLINED_STEREOGRAPHIC__config;
    further = control_point_names(grid.Nx, grid.Ny);
  }
  const int count = mrcal_lensmodel_num_params(&*parsed) - static_cast<int>(names.size());
  names.insert(names.end(), further.begin(), further.begin() + count);
  return names;
}

const char* lens_model_choices() {
  return "LENSMODEL_PINHOLE, LENSMODEL_OPENCV4, LENSMODEL_OPENCV5, LENSMODEL_OPENCV8, LENSMODEL_OPENCV12, "
         "LENSMODEL_CAHVOR and LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=..._Ny=..._fov_x_deg=...";
}

RayTable::RayTable(const Lens& lens) : width_px_(lens.size().width_px) {
  const auto [width, height] = lens.size();
  const double none = std::numeric_limits<double>::quiet_NaN();
  rays_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto ray = lens.ray({x, y});
      rays_.emplace_back(ray && ray->z() > 0 ? ray->head<2>() : Eigen::Vector2d(none, none));
    }
  }
}

bool RayTable::has(int x, int y) const { return std::isfinite(rays_[index(x, y)].x()); }

Eigen::Vector3d RayTable::at(int x, int y) const { return rays_[index(x, y)].homogeneous(); }

std::size_t RayTable::index(int x, int y) const {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) + static_cast<std::size_t>(x);
}

}  // namespace crumple
