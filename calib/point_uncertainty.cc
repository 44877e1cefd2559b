#include "calib/point_uncertainty.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <Eigen/LU>
#include <fmt/format.h>

#include "calib/point_shares.h"
#include "solvers/decompositions.h"
#include "solvers/parallel.h"
#include "solvers/parameters.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

constexpr std::size_t kPointBlock = 4096;
constexpr Eigen::Index kMostAlone = 200;  // parameters of a view's sensors; of more, taking them apart costs too much
constexpr double kLeastTurn = 1e-9;       // of the determinant of unit rows: readings that tell no point

// A sensor's pixel of a point in the probe frame, by the point and by lens and mount, side by side.
struct SensorPixel {
  Matrix2x3d d_point;
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> d_sensor;
};

bool pixel_of(const Sensor& sensor, const Eigen::Vector3d& in_probe, SensorPixel& result) {
  const Eigen::Index lens = sensor.lens.parameter_count();
  result.d_sensor.resize(2, lens + 6);
  Eigen::Vector2d pixel;
  Matrix2x3d d_in_sensor;
  if (!sensor.lens.project_into(sensor.sensor_from_mount * in_probe, pixel, d_in_sensor, result.d_sensor.row(0).data(),
                                result.d_sensor.row(1).data())) {
    return false;
  }
  result.d_sensor.rightCols<6>() = d_in_sensor * d_transformed_d_pose(sensor.sensor_from_mount, in_probe);
  result.d_point = d_in_sensor * sensor.sensor_from_mount.rotation.toRotationMatrix();
  return true;
}

std::vector<std::string> names_of(const Rig& rig, std::size_t sensor) {
  const CalibrationState state{rig, {}, {}, {}};
  std::vector<std::string> names =
      parameter_names({BlockId::Kind::lens, rig.sensors[sensor].lens_of.value_or(sensor)}, state);
  const std::vector<std::string> mount = parameter_names({BlockId::Kind::mount, sensor}, state);
  names.insert(names.end(), mount.begin(), mount.end());
  return names;
}

// row * root into `result`, whose further variables become zero.
template <typename Row>
void multiply(const Row& row, const RowMajorMatrix& root, Eigen::Ref<Eigen::RowVectorXd> result) {
  result.head(root.cols()).noalias() = row * root;
  result.tail(result.size() - root.cols()).setZero();
}

Expected<void> check_view(const Rig& rig, const StationPoses& poses, const MeasuredView& view) {
  const bool there = view.camera < rig.sensors.size() && view.projector < rig.sensors.size();
  if (!there || view.station >= poses.stations.size() || view.angles_rad.empty()) {
    return fail("a view is of a sensor or a station that there is not, or of no stripes");
  }
  return {};
}

Expected<void> check_sizes(const Rig& rig, const StationPoses& poses) {
  const auto rows = static_cast<Eigen::Index>(rig.covariance.names.size());
  const auto six = 6 * static_cast<Eigen::Index>(poses.stations.size());
  if (rows == 0) return fail("the rig has no covariance, so nothing says how sure its points are: calibrate it anew");
  if (poses.d_rig.rows() != six || poses.d_rig.cols() != rows || poses.covariance.rows() != six ||
      poses.covariance.cols() != six) {
    return fail("the stations' poses were found with another rig: its covariance has other rows");
  }
  return {};
}

}  // namespace

Expected<PointUncertainty> PointUncertainty::create(const Rig& rig, const StationPoses& poses) {
  if (auto sound = check_sizes(rig, poses); !sound) return tl::unexpected(sound.error());
  for (const MeasuredView& view : poses.views) {
    if (auto sound = check_view(rig, poses, view); !sound) return tl::unexpected(sound.error());
  }
  PointUncertainty result(rig, poses);
  if (auto done = result.order_variables(rig); !done) return tl::unexpected(done.error());
  for (const MeasuredView& view : poses.views) result.add_view(rig, view);
  return result;
}

Expected<void> PointUncertainty::order_variables(const Rig& rig) {
  std::set<std::string> of_views;
  for (const MeasuredView& view : poses_.views) {
    for (const std::size_t sensor : {view.camera, view.projector}) {
      const std::vector<std::string> names = names_of(rig, sensor);
      of_views.insert(names.begin(), names.end());
    }
  }
  const std::vector<std::string>& names = rig.covariance.names;
  const auto take = [&](const auto& wanted) {
    for (int i = 0; i < static_cast<int>(names.size()); ++i) {
      const bool taken = std::find(rows_.begin(), rows_.end(), i) != rows_.end();
      if (!taken && wanted(i)) rows_.push_back(i);
    }
  };
  take([&](int i) { return is_scale(names[static_cast<std::size_t>(i)]); });
  scale_variables_ = static_cast<Eigen::Index>(rows_.size());
  take([&](int i) { return of_views.contains(names[static_cast<std::size_t>(i)]); });
  take([&](int i) { return !poses_.d_rig.col(i).isZero(0); });
  const auto inverse_root = inverse_cholesky_factor(rig.covariance.matrix(rows_, rows_));
  if (!inverse_root) return fail("the rig's covariance is not positive definite");
  root_ = inverse_lower(*inverse_root);
  return {};
}

PointUncertainty::SharedRows PointUncertainty::root_of(const Rig& rig, std::size_t sensor) {
  SharedRows& known = sensor_roots_[sensor];
  if (known) return known;
  const std::vector<std::string> names = names_of(rig, sensor);
  RowMajorMatrix rows = RowMajorMatrix::Zero(static_cast<Eigen::Index>(names.size()), root_.cols());
  Eigen::Index last = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (rig.covariance.names[static_cast<std::size_t>(rows_[k])] != names[i]) continue;
      rows.row(static_cast<Eigen::Index>(i)) = root_.row(static_cast<Eigen::Index>(k));
      last = std::max(last, static_cast<Eigen::Index>(k) + 1);
    }
  }
  known = std::make_shared<const RowMajorMatrix>(rows.leftCols(last));  // the root is lower triangular
  return known;
}

void PointUncertainty::add_view(const Rig& rig, const MeasuredView& view) {
  ViewRoots& roots = views_.emplace_back();
  roots.stripes.setZero();
  for (const double angle : view.angles_rad) {
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
    roots.stripes += normal * normal.transpose();
  }
  const auto six = 6 * static_cast<Eigen::Index>(view.station);
  const RowMajorMatrix pose = poses_.d_rig.middleRows<6>(six)(Eigen::all, rows_) * root_;
  roots.common = {root_of(rig, view.camera), root_of(rig, view.projector),
                  std::make_shared<const RowMajorMatrix>(pose)};
  const RowMajorMatrix &camera = *roots.common.camera, &projector = *roots.common.projector;
  const Eigen::Index of_camera = camera.rows(), of_both = of_camera + projector.rows();
  roots.alone = roots.common;
  if (of_both > kMostAlone) return;

  // [M; 0] = L Q: rows that are needed alone need no more variables than they are.
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(of_both + 6, root_.cols());
  all.topLeftCorner(of_camera, camera.cols()) = camera;
  all.block(of_camera, 0, projector.rows(), projector.cols()) = projector;
  all.bottomRows<6>() = pose;
  const Eigen::MatrixXd lower = triangular_factor(all.transpose()).transpose();
  const auto rows = [&](Eigen::Index first, Eigen::Index count) {
    return std::make_shared<const RowMajorMatrix>(lower.block(first, 0, count, std::min(first + count, lower.cols())));
  };
  roots.alone = {rows(0, of_camera), rows(of_camera, projector.rows()), rows(of_both, 6)};
}

Matrix3x6d PointUncertainty::d_pose(std::size_t view, const Eigen::Vector3d& in_cloud) const {
  const Pose& pose = poses_.stations[poses_.views[view].station].world_from_probe;
  Matrix3x6d by_pose;
  by_pose << -cross_matrix(in_cloud - pose.translation), Eigen::Matrix3d::Identity();
  return by_pose;
}

bool PointUncertainty::add(std::size_t view, double weight, const Roots& roots, const Eigen::Vector3d& in_cloud,
                           PointRows& by_rig) const {
  thread_local SensorPixel camera, projector;
  thread_local PointRows readings;
  const MeasuredView& of = poses_.views[view];
  const Pose& pose = poses_.stations[of.station].world_from_probe;
  const Eigen::Vector3d point = pose.rotation.conjugate() * (in_cloud - pose.translation);
  if (!pixel_of(sensors_[of.camera], point, camera) || !pixel_of(sensors_[of.projector], point, projector)) {
    return false;
  }
  const Pose& cam_from_probe = sensors_[of.camera].sensor_from_mount;
  const Eigen::Vector3d along_ray = point + cam_from_probe.rotation.conjugate() * cam_from_probe.translation;
  const Eigen::RowVector2d weighed = (views_[view].stripes * (projector.d_point * along_ray)).normalized();
  Eigen::Matrix3d d_point;
  d_point << camera.d_point, weighed * projector.d_point;
  const double turn = d_point.determinant() / (d_point.row(0).norm() * d_point.row(1).norm() * d_point.row(2).norm());
  if (!(std::abs(turn) > kLeastTurn)) return false;

  // How the readings of a point that stays move, and the point at readings that stay.
  readings.resize(3, by_rig.cols());
  multiply(camera.d_sensor.row(0), *roots.camera, readings.row(0));
  multiply(camera.d_sensor.row(1), *roots.camera, readings.row(1));
  multiply(weighed * projector.d_sensor, *roots.projector, readings.row(2));
  const Eigen::Matrix3d by_readings = -weight * (pose.rotation.toRotationMatrix() * d_point.inverse());
  const Matrix3x6d by_pose = weight * d_pose(view, in_cloud);
  const RowMajorMatrix& owed = *roots.pose;
  for (Eigen::Index i = 0; i < 3; ++i) {
    by_rig.row(i) += by_readings(i, 0) * readings.row(0) + by_readings(i, 1) * readings.row(1) +
                     by_readings(i, 2) * readings.row(2) + by_pose(i, 0) * owed.row(0) + by_pose(i, 1) * owed.row(1) +
                     by_pose(i, 2) * owed.row(2) + weight * owed.row(3 + i);
  }
  return true;
}

bool PointUncertainty::sensitivity(const Eigen::Vector3d& in_cloud, std::span<const CloudShare> shares,
                                   PointSensitivity& result) const {
  result.by_rig.setZero(3, variables());
  result.by_station.clear();
  for (const CloudShare& share : shares) {
    if (!add(share.view, share.weight, views_[share.view].common, in_cloud, result.by_rig)) return false;
    const std::size_t station = poses_.views[share.view].station;
    const Matrix3x6d by_pose = share.weight * d_pose(share.view, in_cloud);
    const auto same = std::find_if(result.by_station.begin(), result.by_station.end(),
                                   [&](const StationSensitivity& s) { return s.station == station; });
    if (same != result.by_station.end()) {
      same->d_pose += by_pose;
    } else {
      result.by_station.push_back({station, by_pose});
    }
  }
  return true;
}

PointParts PointUncertainty::parts(const PointSensitivity& sensitivity) const {
  PointParts parts;
  parts.calibration = sensitivity.by_rig.lazyProduct(sensitivity.by_rig.transpose());
  for (const StationSensitivity& a : sensitivity.by_station) {
    for (const StationSensitivity& b : sensitivity.by_station) {
      const Matrix6d covariance = poses_.covariance.block<6, 6>(6 * static_cast<Eigen::Index>(a.station),
                                                                6 * static_cast<Eigen::Index>(b.station));
      parts.station += a.d_pose * covariance * b.d_pose.transpose();
    }
  }
  return parts;
}

bool PointUncertainty::parts_of(const Eigen::Vector3d& in_cloud, std::span<const CloudShare> shares,
                                PointParts& result) const {
  thread_local PointSensitivity sensitivity_here;
  if (shares.size() > 1) {
    if (!sensitivity(in_cloud, shares, sensitivity_here)) return false;
  } else {
    const std::size_t view = shares[0].view;
    const Roots& roots = views_[view].alone;
    sensitivity_here.by_rig.setZero(3, roots.pose->cols());
    if (!add(view, shares[0].weight, roots, in_cloud, sensitivity_here.by_rig)) return false;
    sensitivity_here.by_station.assign(1, {poses_.views[view].station, shares[0].weight * d_pose(view, in_cloud)});
  }
  result = parts(sensitivity_here);
  return true;
}

Expected<std::vector<PointParts>> PointUncertainty::parts(const Cloud& cloud, int threads) const {
  for (const CloudShare& share : cloud.shares) {
    if (share.view >= poses_.views.size()) return fail("a point is of a view that its stations do not have");
  }
  for (const CloudPoint& point : cloud.points) {
    if (point.view >= poses_.views.size()) return fail("a point is of a view that its stations do not have");
  }
  const PointShares shares(cloud);
  std::vector<PointParts> result(cloud.points.size());
  std::vector<std::size_t> refused((cloud.points.size() + kPointBlock - 1) / kPointBlock, cloud.points.size());
  parallel_for(refused.size(), threads, [&](std::size_t block) {
    CloudShare own;
    const std::size_t end = std::min(cloud.points.size(), (block + 1) * kPointBlock);
    for (std::size_t i = block * kPointBlock; i < end; ++i) {
      if (!parts_of(cloud.points[i].position_mm, shares.of(i, own), result[i])) {
        refused[block] = std::min(refused[block], i);
      }
    }
  });
  const auto first = std::min_element(refused.begin(), refused.end());
  if (first != refused.end() && *first < cloud.points.size()) {
    return fail(
        fmt::format("point {} lies where its view's camera or projector does not see, or tells no depth: cloud "
                    "and rig do not belong together",
                    *first));
  }
  return result;
}

}  // namespace crumple
