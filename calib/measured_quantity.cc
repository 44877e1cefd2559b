#include "calib/measured_quantity.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kLeastLength_mm = 1e-9;
constexpr double kLeastSine = 1e-9;

// How a quantity moves with the first values of a feature.
struct Gradient {
  const MeasuredFeature& feature;
  Eigen::RowVectorXd by_values;
};

MeasuredQuantity quantity(const PointUncertainty& known, double value, const std::vector<Gradient>& gradients) {
  Eigen::RowVectorXd by_rig = Eigen::RowVectorXd::Zero(known.variables());
  Eigen::RowVectorXd by_pose = Eigen::RowVectorXd::Zero(known.poses().covariance.cols());
  MeasuredQuantity result{value, {}};
  for (const Gradient& g : gradients) {
    const Eigen::Index count = g.by_values.size();
    by_rig += g.by_values * g.feature.by_rig.topRows(count);
    by_pose += g.by_values * g.feature.by_pose.topRows(count);
    result.budget.decoding += g.by_values.dot(g.feature.decoding.topLeftCorner(count, count) * g.by_values.transpose());
  }
  result.budget.scale = by_rig.head(known.scale_variables()).squaredNorm();
  result.budget.calibration = by_rig.tail(known.variables() - known.scale_variables()).squaredNorm();
  result.budget.station = std::max(by_pose.dot(known.poses().covariance * by_pose.transpose()), 0.0);
  return result;
}

Expected<double> between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double sine = a.cross(b).norm();
  if (!(sine > kLeastSine))
    return fail("the directions are parallel, so their angle has no uncertainty to first order");
  return std::atan2(sine, a.dot(b));
}

// How the angle between unit vectors moves with the first: away from the second, in the plane of both.
Eigen::RowVector3d d_angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return -(b - a.dot(b) * a).normalized().transpose();
}

}  // namespace

MeasuredQuantity value_of(const PointUncertainty& known, const MeasuredFeature& feature, Eigen::Index value,
                          double factor) {
  const Eigen::RowVectorXd unit = factor * Eigen::RowVectorXd::Unit(feature.values.size(), value);
  return quantity(known, factor * feature.values[value], {{feature, unit}});
}

Expected<MeasuredQuantity> distance(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& b) {
  const Eigen::Vector3d apart = b.position() - a.position();
  if (!(apart.norm() > kLeastLength_mm)) return fail("they are at the same place");
  const Eigen::RowVector3d along = apart.normalized().transpose();
  return quantity(known, apart.norm(), {{a, -along}, {b, along}});
}

MeasuredQuantity distance_from_plane(const PointUncertainty& known, const MeasuredFeature& position,
                                     const MeasuredFeature& plane) {
  const Eigen::Vector3d apart = position.position() - plane.position();
  Eigen::RowVectorXd by_plane(6);
  by_plane << -plane.normal().transpose(), apart.transpose();
  return quantity(known, plane.normal().dot(apart), {{position, plane.normal().transpose()}, {plane, by_plane}});
}

Expected<MeasuredQuantity> outer_length(const PointUncertainty& known, const MeasuredFeature& a,
                                        const MeasuredFeature& b) {
  const Eigen::Vector3d apart = b.position() - a.position();
  if (!(apart.norm() > kLeastLength_mm)) return fail("they are at the same place");
  Eigen::RowVector4d along;
  along << apart.normalized().transpose(), 1;
  Eigen::RowVector4d back = -along;
  back[3] = 1;
  return quantity(known, apart.norm() + a.radius() + b.radius(), {{a, back}, {b, along}});
}

std::array<NormalTilt, 2> normal_tilts(const PointUncertainty& known, const MeasuredFeature& plane) {
  const Eigen::Vector3d normal = plane.normal();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = normal.unitOrthogonal();
  across.col(1) = normal.cross(across.col(0));
  const Eigen::MatrixXd by_rig = across.transpose() * plane.by_rig.bottomRows<3>();
  const Eigen::MatrixXd by_pose = across.transpose() * plane.by_pose.bottomRows<3>();
  const SymmetricEigen2 axes =
      symmetric_eigen2(by_rig * by_rig.transpose() + by_pose * known.poses().covariance * by_pose.transpose() +
                       across.transpose() * plane.decoding.bottomRightCorner<3, 3>() * across);
  const auto about = [&](int axis) {
    const Eigen::Vector3d way = across * axes.vectors.col(axis);  // of the normal's tip
    Eigen::RowVectorXd by_values = Eigen::RowVectorXd::Zero(6);
    by_values.tail<3>() = way.transpose();
    return NormalTilt{normal.cross(way), quantity(known, 0, {{plane, by_values}})};
  };
  return {about(1), about(0)};
}

Expected<MeasuredQuantity> angle(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& b) {
  const Eigen::Vector3d na = a.normal(), nb = b.normal();
  const auto value = between(na, nb);
  if (!value) return tl::unexpected(value.error());
  Eigen::RowVectorXd by_a = Eigen::RowVectorXd::Zero(6), by_b = Eigen::RowVectorXd::Zero(6);
  by_a.tail<3>() = d_angle(na, nb);
  by_b.tail<3>() = d_angle(nb, na);
  return quantity(known, *value, {{a, by_a}, {b, by_b}});
}

Expected<MeasuredQuantity> angle(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& at,
                                 const MeasuredFeature& b) {
  const Eigen::Vector3d to_a = a.position() - at.position(), to_b = b.position() - at.position();
  if (!(std::min(to_a.norm(), to_b.norm()) > kLeastLength_mm)) return fail("two of the three are at the same place");
  const Eigen::Vector3d ua = to_a.normalized(), ub = to_b.normalized();
  const auto value = between(ua, ub);
  if (!value) return tl::unexpected(value.error());
  const Eigen::RowVector3d by_a = d_angle(ua, ub) / to_a.norm(), by_b = d_angle(ub, ua) / to_b.norm();
  return quantity(known, *value, {{a, by_a}, {at, -by_a - by_b}, {b, by_b}});
}

}  // namespace crumple
