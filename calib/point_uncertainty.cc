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

namespace crumple {
namespace {

constexpr std::size_t kPointBlock = 4096;
constexpr double kLeastTurn = 1e-9;  // of the determinant of unit rows: readings that tell no point

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

bool is_scale(const std::string& name) { return name.ends_with(".scale"); }

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
  for (std::size_t s = 0; s < poses.stations.size(); ++s) {
    const auto six = 6 * static_cast<Eigen::Index>(s);
    result.pose_root_.emplace_back(poses.d_rig.middleRows<6>(six)(Eigen::all, result.rows_) * result.root_);
  }
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

Eigen::MatrixXd PointUncertainty::root_of(const Rig& rig, const std::vector<std::string>& names) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(names.size()), root_.cols());
  Eigen::Index last = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (rig.covariance.names[static_cast<std::size_t>(rows_[k])] != names[i]) continue;
      result.row(static_cast<Eigen::Index>(i)) = root_.row(static_cast<Eigen::Index>(k));
      last = std::max(last, static_cast<Eigen::Index>(k) + 1);
    }
  }
  return result.leftCols(last);  // the root is lower triangular
}

void PointUncertainty::add_view(const Rig& rig, const MeasuredView& view) {
  Eigen::Matrix2d stripes = Eigen::Matrix2d::Zero();
  for (const double angle : view.angles_rad) {
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
    stripes += normal * normal.transpose();
  }
  const auto known = std::find_if(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
    return pair.camera == view.camera && pair.projector == view.projector && pair.stripes == stripes;
  });
  pair_of_view_.push_back(static_cast<std::size_t>(known - pairs_.begin()));
  if (known != pairs_.end()) return;
  std::vector<std::string> names = names_of(rig, view.camera);
  const std::vector<std::string> of_projector = names_of(rig, view.projector);
  names.insert(names.end(), of_projector.begin(), of_projector.end());
  pairs_.push_back({view.camera, view.projector, stripes, root_of(rig, names)});
}

bool PointUncertainty::in_probe(const Pair& pair, const Eigen::Vector3d& point, Matrix3Xd& d_pair) const {
  thread_local SensorPixel camera, projector;
  if (!pixel_of(sensors_[pair.camera], point, camera) || !pixel_of(sensors_[pair.projector], point, projector)) {
    return false;
  }
  const Pose& cam_from_probe = sensors_[pair.camera].sensor_from_mount;
  const Eigen::Vector3d along_ray = point + cam_from_probe.rotation.conjugate() * cam_from_probe.translation;
  const Eigen::RowVector2d weighed = (pair.stripes * (projector.d_point * along_ray)).normalized();
  Eigen::Matrix3d d_point;
  d_point << camera.d_point, weighed * projector.d_point;
  const double turn = d_point.determinant() / (d_point.row(0).norm() * d_point.row(1).norm() * d_point.row(2).norm());
  if (!(std::abs(turn) > kLeastTurn)) return false;
  const Eigen::Matrix3d inverse = d_point.inverse();
  const Eigen::Index of_camera = camera.d_sensor.cols(), of_projector = projector.d_sensor.cols();
  d_pair.resize(3, of_camera + of_projector);
  d_pair.leftCols(of_camera).noalias() = -inverse.leftCols<2>() * camera.d_sensor;
  const Eigen::Matrix<double, 3, 2> along = -inverse.col(2) * weighed;
  d_pair.rightCols(of_projector).noalias() = along * projector.d_sensor;
  return true;
}

bool PointUncertainty::sensitivity(const Eigen::Vector3d& in_cloud, std::span<const CloudShare> shares,
                                   PointSensitivity& result) const {
  thread_local Matrix3Xd d_pair, in_world;
  result.by_rig.setZero(3, variables());
  result.by_station.clear();
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const std::size_t view = shares[i].view, station = poses_.views[view].station;
    const Pair& pair = pairs_[pair_of_view_[view]];
    const Pose& pose = poses_.stations[station].world_from_probe;
    const double weight = shares[i].weight;
    const Eigen::Vector3d turned = in_cloud - pose.translation;
    if (!in_probe(pair, pose.rotation.conjugate() * turned, d_pair)) return false;
    // What one pair measured from several stations goes through its covariance at once.
    const bool first = i == 0 || pair_of_view_[view] != pair_of_view_[shares[i - 1].view];
    const bool last = i + 1 == shares.size() || pair_of_view_[view] != pair_of_view_[shares[i + 1].view];
    if (first) in_world.setZero(3, d_pair.cols());
    in_world.noalias() += weight * pose.rotation.toRotationMatrix() * d_pair;
    if (last) result.by_rig.leftCols(pair.root.cols()).noalias() += in_world * pair.root;
    Matrix3x6d d_pose;
    d_pose << -cross_matrix(turned), Eigen::Matrix3d::Identity();
    d_pose *= weight;
    result.by_rig.noalias() += d_pose * pose_root_[station];
    const auto same = std::find_if(result.by_station.begin(), result.by_station.end(),
                                   [&](const StationSensitivity& s) { return s.station == station; });
    if (same != result.by_station.end()) {
      same->d_pose += d_pose;
    } else {
      result.by_station.push_back({station, d_pose});
    }
  }
  return true;
}

PointParts PointUncertainty::parts(const PointSensitivity& sensitivity) const {
  PointParts parts;
  parts.calibration.noalias() = sensitivity.by_rig.lazyProduct(sensitivity.by_rig.transpose());
  for (const StationSensitivity& a : sensitivity.by_station) {
    for (const StationSensitivity& b : sensitivity.by_station) {
      const auto covariance = poses_.covariance.block<6, 6>(6 * static_cast<Eigen::Index>(a.station),
                                                            6 * static_cast<Eigen::Index>(b.station));
      parts.station.noalias() += a.d_pose * covariance * b.d_pose.transpose();
    }
  }
  return parts;
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
    PointSensitivity sensitivity_here;
    CloudShare own;
    const std::size_t end = std::min(cloud.points.size(), (block + 1) * kPointBlock);
    for (std::size_t i = block * kPointBlock; i < end; ++i) {
      if (sensitivity(cloud.points[i].position_mm, shares.of(i, own), sensitivity_here)) {
        result[i] = parts(sensitivity_here);
      } else {
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
