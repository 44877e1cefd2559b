// What the rig and the stations' poses put on measured points, with all that points have in common.
//
// A point X was measured as a camera pixel p and stripe coordinates s, and nothing else of its measurement is needed:
// both follow from X, the station's pose and the rig. At fixed readings
//
//   F(X, rig) = (p, m . s),   dX = -(dF/dX)^-1 dF/drig d rig        in the probe frame
//
// where m is the direction that the estimator weighs stripe coordinates in: with equal weights of the orientations
// n_o, and e how the projector's pixel moves with depth, m = (sum_o n_o n_o') e (recon/triangulate.h: weighted_depth).
// Into the world go the pose, and with it what the pose owes to the rig (calib/station_poses.h):
//
//   d world = R dX + D (G d rig + noise),   D = d(pose X)/d pose.
//
// The three parts of a point's uncertainty (JCGM 102: several quantities with common causes)
//   calibration   common to all points: of the rig, by independent variables of unit variance; the first of these are
//                 the scale's, as certificates tell it, so its share is told apart
//   station       common to the points of a station: of the LEDs' pixels
//   decoding      a point's own; not here but in the cloud (CloudPoint::covariance_mm2)
// Linear throughout. What is not a parameter (temperature during the measurement, a surface that scatters light from
// below itself, stray light) is not in it.
//
// Merged points are means of points: their sensitivities are the means of those, each taken at the merged point.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/station_poses.h"
#include "recon/cloud.h"
#include "solvers/residuals.h"
#include "solvers/stripe_point.h"

namespace crumple {

// Row by row, as sums over parameters want it.
using PointRows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

struct StationSensitivity {
  std::size_t station = 0;
  Matrix3x6d d_pose;
};

// How a point in the cloud's frame moves, mm.
struct PointSensitivity {
  PointRows by_rig;                            // by the variables; their squares' sums are variances
  std::vector<StationSensitivity> by_station;  // by the tangents of poses
};

// Covariances in the cloud's frame, mm^2.
struct PointParts {
  Eigen::Matrix3d calibration = Eigen::Matrix3d::Zero();  // scale included
  Eigen::Matrix3d station = Eigen::Matrix3d::Zero();
};

class PointUncertainty {
 public:
  // Fails on a rig without a covariance or with one that is not positive definite, on poses that do not fit it and on
  // views of sensors that it does not have.
  static Expected<PointUncertainty> create(const Rig& rig, const StationPoses& poses);

  Eigen::Index variables() const { return static_cast<Eigen::Index>(rows_.size()); }
  // How many of them, the first ones, are the scale's; 0 where it is not known.
  Eigen::Index scale_variables() const { return scale_variables_; }
  const StationPoses& poses() const { return poses_; }

  // False where a view cannot have measured the point: the camera or the projector does not see it, or its stripes
  // tell nothing of its depth. `shares` are the point's; their weights sum to one.
  bool sensitivity(const Eigen::Vector3d& in_cloud, std::span<const CloudShare> shares, PointSensitivity& result) const;
  PointParts parts(const PointSensitivity& sensitivity) const;

  // Of every point of a cloud. Fails naming the first point that its views cannot have measured, and on views that
  // there are not.
  Expected<std::vector<PointParts>> parts(const Cloud& cloud, int threads) const;

 private:
  // A view's parameters by independent variables, as rows: each without the variables that it does not need.
  using SharedRows = std::shared_ptr<const RowMajorMatrix>;
  struct Roots {
    SharedRows camera;  // lens and mount
    SharedRows projector;
    SharedRows pose;  // what the station's pose owes to the rig
  };
  struct ViewRoots {
    Eigen::Matrix2d stripes;  // sum of n n'
    Roots common;             // by the variables of all
    Roots alone;              // by fewer, which are this view's only: the same covariance
  };
  PointUncertainty(const Rig& rig, const StationPoses& poses) : sensors_(rig.sensors), poses_(poses) {}
  Expected<void> order_variables(const Rig& rig);
  void add_view(const Rig& rig, const MeasuredView& view);
  SharedRows root_of(const Rig& rig, std::size_t sensor);
  // Adds what a view measures, times its weight, to by_rig.
  bool add(std::size_t view, double weight, const Roots& roots, const Eigen::Vector3d& in_cloud,
           PointRows& by_rig) const;
  Matrix3x6d d_pose(std::size_t view, const Eigen::Vector3d& in_cloud) const;
  bool parts_of(const Eigen::Vector3d& in_cloud, std::span<const CloudShare> shares, PointParts& result) const;

  std::vector<Sensor> sensors_;
  StationPoses poses_;
  std::vector<int> rows_;  // of the rig's covariance: what matters, scales first, then the probe's sensors
  Eigen::Index scale_variables_ = 0;
  Eigen::MatrixXd root_;  // of the covariance of these
  std::map<std::size_t, SharedRows> sensor_roots_;
  std::vector<ViewRoots> views_;
};

}  // namespace crumple
