#include "solvers/projection_uncertainty.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "solvers/body_motion.h"
#include "solvers/decompositions.h"
#include "solvers/parallel.h"
#include "solvers/rig_covariance.h"
#include "solvers/small_motion.h"

namespace crumple {
namespace {

// (lens, mount, datum) -> (lens, r, s).
Eigen::MatrixXd d_in_sensor(int lens_rows, const Pose& sensor_from_mount) {
  const Eigen::Matrix3d turn = sensor_from_mount.rotation.toRotationMatrix();
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(lens_rows + 6, lens_rows + 12);
  d.topLeftCorner(lens_rows, lens_rows).setIdentity();
  d.block<6, 6>(lens_rows, lens_rows) = d_motion_d_pose(sensor_from_mount);
  const Eigen::Vector3d& t = sensor_from_mount.translation;
  d.block<3, 3>(lens_rows, lens_rows + 6) = turn;
  d.block<3, 3>(lens_rows + 3, lens_rows + 6) = cross_matrix(t) * turn;
  d.block<3, 3>(lens_rows + 3, lens_rows + 9) = turn;
  return d;
}

}  // namespace

Expected<ProjectionUncertainty> ProjectionUncertainty::create(const Rig& rig, std::size_t sensor) {
  const Sensor& of = rig.sensors[sensor];
  if (rig.covariance.names.empty()) return fail("the rig has no covariance: calibrate it anew");
  const std::string& lens_owner = rig.sensors[of.lens_of.value_or(sensor)].name;
  std::vector<std::string> names;
  for (const std::string& name : lens_parameter_names(of.lens.model())) names.push_back(lens_owner + "." + name);
  for (const char* row : kPoseRows) names.push_back(of.name + "." + row);
  const std::vector<std::string> datum = datum_names(of.mount);
  names.insert(names.end(), datum.begin(), datum.end());
  for (const std::string& name : datum) {
    if (find_row(rig.covariance, name)) continue;
    return fail(
        fmt::format("the rig's covariance has no row {}, which tells how well the frame of sensor {} is known "
                    "from the boards or LEDs seen: calibrate it anew",
                    name, of.name));
  }
  const Eigen::MatrixXd d = d_in_sensor(of.lens.parameter_count(), of.sensor_from_mount);
  const Eigen::MatrixXd half = d * covariance_of(rig.covariance, names);
  return ProjectionUncertainty(of.lens, half * d.transpose());
}

std::optional<Eigen::Matrix2d> ProjectionUncertainty::at(const Eigen::Vector3d& point, bool infinite) const {
  const auto projection = lens_.project_with_gradients(point);
  if (!projection) return std::nullopt;
  // A splined lens depends on few of its many parameters here: the others are left out.
  const Eigen::Index lens_rows = lens_.parameter_count(), motion_rows = infinite ? 3 : 6;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < lens_rows; ++i) {
    if (!projection->d_parameters.col(i).isZero(0)) rows.push_back(i);
  }
  const auto lens_part = static_cast<Eigen::Index>(rows.size());
  for (Eigen::Index i = 0; i < motion_rows; ++i) rows.push_back(lens_rows + i);
  Eigen::Matrix2Xd d(2, lens_part + motion_rows);
  for (Eigen::Index i = 0; i < lens_part; ++i) {
    d.col(i) = projection->d_parameters.col(rows[static_cast<std::size_t>(i)]);
  }
  d.middleCols<3>(lens_part) = -projection->d_point * cross_matrix(point);
  if (!infinite) d.rightCols<3>() = projection->d_point;
  Eigen::Matrix2d result = Eigen::Matrix2d::Zero();
  for (Eigen::Index k = 0; k < d.cols(); ++k) {
    const double* column = covariance_.col(rows[static_cast<std::size_t>(k)]).data();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (Eigen::Index i = 0; i < d.cols(); ++i) sum += d.col(i) * column[rows[static_cast<std::size_t>(i)]];
    result += sum * d.col(k).transpose();
  }
  return Eigen::Matrix2d(0.5 * (result + result.transpose()));
}

std::optional<Eigen::Matrix2d> ProjectionUncertainty::at_point(const Eigen::Vector3d& point_mm) const {
  return at(point_mm, false);
}

std::optional<Eigen::Matrix2d> ProjectionUncertainty::at_infinity(const Eigen::Vector3d& direction) const {
  return at(direction, true);
}

std::optional<Eigen::Matrix2d> ProjectionUncertainty::at_pixel(const Eigen::Vector2d& pixel, double distance_mm) const {
  assert(distance_mm > 0);
  const auto ray = lens_.ray(pixel);
  if (!ray) return std::nullopt;
  return std::isinf(distance_mm) ? at_infinity(*ray) : at_point(distance_mm * ray->normalized());
}

double worst_direction_sigma(const Eigen::Matrix2d& covariance) {
  const double mean = 0.5 * covariance.trace(), half = 0.5 * (covariance(0, 0) - covariance(1, 1));
  return std::sqrt(std::max(0.0, mean + std::hypot(half, covariance(0, 1))));
}

Eigen::Vector2d ProjectionUncertaintyMap::pixel(int column, int row) const {
  return {static_cast<double>(column) / (columns - 1) * (size.width_px - 1),
          static_cast<double>(row) / (rows - 1) * (size.height_px - 1)};
}

const std::optional<Eigen::Matrix2d>& ProjectionUncertaintyMap::at(int column, int row) const {
  return covariance_px2[static_cast<std::size_t>(row * columns + column)];
}

std::optional<double> ProjectionUncertaintyMap::sigma_px(int column, int row) const {
  const auto& covariance = at(column, row);
  return covariance ? std::optional(worst_direction_sigma(*covariance)) : std::nullopt;
}

ProjectionUncertaintyMap projection_uncertainty_map(const ProjectionUncertainty& uncertainty, int columns, int rows,
                                                    double distance_mm, int threads) {
  assert(columns > 1 && rows > 1);
  ProjectionUncertaintyMap map{columns, rows, distance_mm, uncertainty.lens().size(), {}};
  map.covariance_px2.resize(static_cast<std::size_t>(columns * rows));
  parallel_for(static_cast<std::size_t>(rows), threads, [&](std::size_t row) {
    for (int column = 0; column < columns; ++column) {
      map.covariance_px2[row * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)] =
          uncertainty.at_pixel(map.pixel(column, static_cast<int>(row)), distance_mm);
    }
  });
  return map;
}

}  // namespace crumple
