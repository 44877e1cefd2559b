// Points, planes and spheres fitted to a cloud, each with what the rig, the stations and decoding put on it.
//
// A feature q is a function of the points it is fitted to, defined by the fit's own conditions g(q, X) = 0; the
// implicit function theorem gives how it moves with every point, dq = sum_i W_i dX_i, exactly, residuals of any size
// included. Through the points' sensitivities (calib/point_uncertainty.h) follows
//   by_rig    sum_i W_i (rig's variables), common to all features of a cloud
//   by_pose   sum_i W_i (tangents of the stations' poses), likewise
//   decoding  sum_i W_i C_i W_i', the feature's own: points' errors of decoding count as independent
// so that what two features have in common is told when they are put together (calib/measured_quantity.h).
//
// Fits are least squares with equal weights, as VDI/VDE 2634 has them.
//   point    mean of the points: of the patch of surface that was measured there
//   plane    orthogonal least squares; the normal on the side of the points' own
//   sphere   radius free (calib/sphere_fit.h)
// Of planes and spheres the decoding part is multiplied by `inflation`: how much larger the squares of the residuals in
// the polynomials up to third degree over the feature are than independent errors of the stated size would make them,
// where chance makes them as large less than once in ten times. It is there that a fit takes its parameters from;
// errors of decoding that neighbouring pixels share, and what the artefact is not flat or round by, are found so (as in
// calib/correlation.h, "far"). Of half a dozen squares a ratio below 1.8 says little; taken as it comes whenever it
// exceeds one, it made spheres' radii seem 7 % less sure than they are (docs/uncertainty.md).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "calib/point_shares.h"
#include "calib/point_uncertainty.h"

namespace crumple {

struct MeasuredFeature {
  enum class Kind { point, plane, sphere };
  Kind kind = Kind::point;
  Eigen::VectorXd values;  // position (of planes the points' mean, of spheres the centre), then normal or radius, mm
  Eigen::MatrixXd by_rig;  // a row per value
  Eigen::MatrixXd by_pose;
  Eigen::MatrixXd decoding;  // covariance of the values

  std::vector<double> residuals_mm;        // of planes and spheres: distances of the points, outside positive
  std::vector<double> residual_sigmas_mm;  // as predicted, all three parts, the fit's own share in them
  double inflation = 1;
  double cap_rad = 0;  // of spheres

  Eigen::Vector3d position() const { return values.head<3>(); }
  Eigen::Vector3d normal() const { return values.tail<3>(); }  // of planes
  double radius() const { return values[3]; }                  // of spheres
};

// A cloud with what is known of it; it must outlive this.
struct KnownCloud {
  KnownCloud(const Cloud& points, const PointUncertainty& known) : cloud(points), uncertainty(known), shares(points) {}
  const Cloud& cloud;
  const PointUncertainty& uncertainty;
  PointShares shares;
};

// `points` are indices of the cloud. They fail on no points, where a fit fails, and on a point that its views cannot
// have measured.
Expected<MeasuredFeature> measure_point(const KnownCloud& known, const std::vector<std::size_t>& points);
Expected<MeasuredFeature> measure_plane(const KnownCloud& known, const std::vector<std::size_t>& points);
Expected<MeasuredFeature> measure_sphere(const KnownCloud& known, const std::vector<std::size_t>& points);

}  // namespace crumple
