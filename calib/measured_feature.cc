#include "calib/measured_feature.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "calib/sphere_fit.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

constexpr double kByChance = 0.1;  // probability of residuals in shapes that is still taken for chance

using Weights = std::vector<Matrix3Xd>;  // W_i', transposed

Expected<PointSensitivity> sensitivity_of(const KnownCloud& known, std::size_t point) {
  PointSensitivity result;
  CloudShare own;
  const auto shares = known.shares.of(point, own);
  if (!known.uncertainty.sensitivity(known.cloud.points[point].position_mm, shares, result)) {
    return fail(
        fmt::format("point {} lies where its view's camera or projector does not see: cloud and rig do not belong "
                    "together",
                    point));
  }
  return result;
}

Eigen::MatrixXd pose_columns(const KnownCloud& known, const PointSensitivity& sensitivity) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3, known.uncertainty.poses().covariance.cols());
  for (const StationSensitivity& station : sensitivity.by_station) {
    result.middleCols<6>(6 * static_cast<Eigen::Index>(station.station)) += station.d_pose;
  }
  return result;
}

// The values' parts from how they move with the points.
Expected<void> carry(const KnownCloud& known, const std::vector<std::size_t>& points, const Weights& weights,
                     MeasuredFeature& feature) {
  const Eigen::Index count = feature.values.size();
  feature.by_rig.setZero(count, known.uncertainty.variables());
  feature.by_pose.setZero(count, known.uncertainty.poses().covariance.cols());
  feature.decoding.setZero(count, count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto sensitivity = sensitivity_of(known, points[i]);
    if (!sensitivity) return tl::unexpected(sensitivity.error());
    const Matrix3Xd& w = weights[i];
    feature.by_rig.noalias() += w.transpose() * sensitivity->by_rig;
    for (const StationSensitivity& station : sensitivity->by_station) {
      feature.by_pose.middleCols<6>(6 * static_cast<Eigen::Index>(station.station)).noalias() +=
          w.transpose() * station.d_pose;
    }
    feature.decoding.noalias() += w.transpose() * known.cloud.points[points[i]].covariance_mm2.cast<double>() * w;
  }
  return {};
}

std::vector<Eigen::Vector3d> positions_of(const KnownCloud& known, const std::vector<std::size_t>& points) {
  std::vector<Eigen::Vector3d> positions;
  for (const std::size_t point : points) positions.push_back(known.cloud.points[point].position_mm);
  return positions;
}

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& positions) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& position : positions) sum += position;
  return sum / static_cast<double>(positions.size());
}

// Of each point its direction of residual, and how the residual moves with the feature's values.
struct SurfaceResidual {
  double residual_mm = 0;
  Eigen::RowVector3d d_point;
  Eigen::RowVectorXd d_values;
  Eigen::Vector2d place;  // over the feature, about -1 to 1
};

// What the residuals' scatter should be. A residual moves with its own point and, through the fit, with all of them.
Expected<void> predict_residuals(const KnownCloud& known, const std::vector<std::size_t>& points,
                                 const Weights& weights, const std::vector<SurfaceResidual>& at,
                                 MeasuredFeature& feature) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto sensitivity = sensitivity_of(known, points[i]);
    if (!sensitivity) return tl::unexpected(sensitivity.error());
    const Eigen::RowVectorXd by_rig = at[i].d_point * sensitivity->by_rig + at[i].d_values * feature.by_rig;
    const Eigen::RowVectorXd by_pose =
        at[i].d_point * pose_columns(known, *sensitivity) + at[i].d_values * feature.by_pose;
    const Eigen::Matrix3d own = known.cloud.points[points[i]].covariance_mm2.cast<double>();
    const Eigen::RowVector3d with_itself = at[i].d_values * weights[i].transpose();
    const double decoding = at[i].d_point.dot(own * (at[i].d_point + 2 * with_itself).transpose()) +
                            at[i].d_values.dot(feature.decoding * at[i].d_values.transpose());
    const double variance =
        by_rig.squaredNorm() + by_pose.dot(known.uncertainty.poses().covariance * by_pose.transpose()) + decoding;
    feature.residuals_mm.push_back(at[i].residual_mm);
    feature.residual_sigmas_mm.push_back(std::sqrt(std::max(variance, 0.0)));
  }
  return {};
}

// Of the residuals in polynomials over the feature, over what independent errors would make of them; see the header.
double inflation_of(const KnownCloud& known, const std::vector<std::size_t>& points,
                    const std::vector<SurfaceResidual>& at) {
  const auto rows = static_cast<Eigen::Index>(points.size());
  const Eigen::Index fitted = at.front().d_values.size();
  constexpr int kDegree = 3;
  constexpr Eigen::Index kTerms = (kDegree + 1) * (kDegree + 2) / 2;
  constexpr double kNoNewShape = 1e-6;
  Eigen::MatrixXd columns(rows, fitted + kTerms);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const SurfaceResidual& here = at[static_cast<std::size_t>(i)];
    columns.row(i).head(fitted) = here.d_values;
    Eigen::Index term = fitted;
    for (int total = 0; total <= kDegree; ++total) {
      for (int y = 0; y <= total; ++y) {
        columns(i, term++) = std::pow(here.place.x(), total - y) * std::pow(here.place.y(), y);
      }
    }
  }
  // Gram-Schmidt, twice; what the fit or an earlier shape has taken already is passed over.
  std::vector<Eigen::VectorXd> basis;
  double found = 0, expected = 0;
  int shapes = 0;
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    const double length = columns.col(c).norm();
    if (!(length > 0)) continue;
    Eigen::VectorXd q = columns.col(c) / length;
    for (int pass = 0; pass < 2; ++pass) {
      for (const Eigen::VectorXd& b : basis) q -= b.dot(q) * b;
    }
    if (q.norm() < kNoNewShape) continue;
    q.normalize();
    basis.push_back(q);
    if (c < fitted) continue;
    double along = 0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const SurfaceResidual& here = at[static_cast<std::size_t>(i)];
      const Eigen::Matrix3d own = known.cloud.points[points[static_cast<std::size_t>(i)]].covariance_mm2.cast<double>();
      along += q[i] * here.residual_mm;
      expected += q[i] * q[i] * here.d_point.dot(own * here.d_point.transpose());
    }
    found += along * along;
    ++shapes;
  }
  if (!(expected > 0)) return 1;
  const double ratio = found / expected;
  return ratio > 1 && chi_square_tail(shapes * ratio, shapes) < kByChance ? ratio : 1;
}

Expected<MeasuredFeature> finished(const KnownCloud& known, const std::vector<std::size_t>& points,
                                   const Weights& weights, const std::vector<SurfaceResidual>& at,
                                   MeasuredFeature feature) {
  if (auto done = carry(known, points, weights, feature); !done) return tl::unexpected(done.error());
  if (auto done = predict_residuals(known, points, weights, at, feature); !done) return tl::unexpected(done.error());
  feature.inflation = inflation_of(known, points, at);
  feature.decoding *= feature.inflation;
  return feature;
}

}  // namespace

Expected<MeasuredFeature> measure_point(const KnownCloud& known, const std::vector<std::size_t>& points) {
  if (points.empty()) return fail("there are no points");
  MeasuredFeature feature;
  feature.kind = MeasuredFeature::Kind::point;
  feature.values = middle_of(positions_of(known, points));
  const Matrix3Xd share = Eigen::Matrix3d::Identity() / static_cast<double>(points.size());
  if (auto done = carry(known, points, Weights(points.size(), share), feature); !done) {
    return tl::unexpected(done.error());
  }
  return feature;
}

// With S = sum x x' about the mean, S n = l n: dn = sum_j e_j e_j' dS n / (l - l_j) over the other eigenvectors.
Expected<MeasuredFeature> measure_plane(const KnownCloud& known, const std::vector<std::size_t>& points) {
  if (points.size() < 3) return fail("a plane needs three points");
  const std::vector<Eigen::Vector3d> positions = positions_of(known, points);
  const Eigen::Vector3d middle = middle_of(positions);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    scatter += (positions[i] - middle) * (positions[i] - middle).transpose();
    towards += known.cloud.points[points[i]].normal.cast<double>();
  }
  const SymmetricEigen3 eigen = symmetric_eigen3(scatter);
  if (!(eigen.values[1] > 1e-9 * eigen.values[2])) return fail("the points lie on a line, so no plane is told");
  Eigen::Vector3d normal = eigen.vectors.col(0);
  if (normal.dot(towards) < 0) normal = -normal;
  MeasuredFeature feature;
  feature.kind = MeasuredFeature::Kind::plane;
  feature.values.resize(6);
  feature.values << middle, normal;
  Weights weights;
  std::vector<SurfaceResidual> at;
  const double reach = std::sqrt(3 * eigen.values[2] / static_cast<double>(points.size()));
  for (const Eigen::Vector3d& position : positions) {
    const Eigen::Vector3d x = position - middle;
    Matrix3Xd w(3, 6);
    w.leftCols<3>() = Eigen::Matrix3d::Identity() / static_cast<double>(points.size());
    Eigen::Matrix3d d_normal = Eigen::Matrix3d::Zero();
    for (int j = 1; j < 3; ++j) {
      const Eigen::Vector3d e = eigen.vectors.col(j);
      d_normal += e * (e.dot(x) * normal + normal.dot(x) * e).transpose() / (eigen.values[0] - eigen.values[j]);
    }
    w.rightCols<3>() = d_normal.transpose();
    weights.push_back(w);
    SurfaceResidual residual{normal.dot(x),
                             normal.transpose(),
                             Eigen::RowVectorXd(6),
                             {eigen.vectors.col(2).dot(x) / reach, eigen.vectors.col(1).dot(x) / reach}};
    residual.d_values << -normal.transpose(), x.transpose();
    at.push_back(std::move(residual));
  }
  return finished(known, points, weights, at, std::move(feature));
}

// The conditions are g = sum a r = 0 with r = |x - c| - R and a = dr/d(c, R) = (-n, -1).
Expected<MeasuredFeature> measure_sphere(const KnownCloud& known, const std::vector<std::size_t>& points) {
  const std::vector<Eigen::Vector3d> positions = positions_of(known, points);
  const auto sphere = fit_sphere(positions);
  if (!sphere) return tl::unexpected(sphere.error());
  MeasuredFeature feature;
  feature.kind = MeasuredFeature::Kind::sphere;
  feature.values.resize(4);
  feature.values << sphere->centre, sphere->radius;
  feature.cap_rad = sphere->cap_rad;
  Eigen::Matrix4d slope = Eigen::Matrix4d::Zero();
  std::vector<Eigen::Matrix<double, 4, 3>> d_condition;
  std::vector<SurfaceResidual> at;
  const Eigen::Vector3d axis = (middle_of(positions) - sphere->centre).normalized();
  const Eigen::Vector3d across = axis.unitOrthogonal();
  for (const Eigen::Vector3d& position : positions) {
    const Eigen::Vector3d from = position - sphere->centre, n = from.normalized();
    const double residual = sphere->distance(position);
    Eigen::Vector4d a;
    a << -n, -1;
    const Eigen::Matrix3d turn = (Eigen::Matrix3d::Identity() - n * n.transpose()) / from.norm();
    slope += a * a.transpose();
    slope.topLeftCorner<3, 3>() += residual * turn;
    Eigen::Matrix<double, 4, 3> d = a * n.transpose();
    d.topRows<3>() -= residual * turn;
    d_condition.push_back(d);
    const double width = std::sin(std::min(sphere->cap_rad, 1.5));
    at.push_back({residual, n.transpose(), a.transpose(), {across.dot(n) / width, axis.cross(across).dot(n) / width}});
  }
  const Eigen::Matrix4d inverse = slope.inverse();
  Weights weights;
  for (const auto& d : d_condition) weights.emplace_back(-(inverse * d).transpose());
  return finished(known, points, weights, at, std::move(feature));
}

}  // namespace crumple
