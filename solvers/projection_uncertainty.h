// How well a calibration knows where a sensor sees a point: the covariance, px^2, of the pixel to which a point is
// projected that is fixed to what the calibration saw.
//
// The point x, in the sensor's frame, is taken as fixed to the bodies that were observed, on average
// (solvers/body_motion.h). With the calibration's own errors the lens's parameters are off by dl, the mount by the
// tangent (w, d) and the bodies, in the mount's frame, by the mean motion (W, T). In the sensor's frame the point then
// moves by
//   dx = r x x + s,   r = w + R W,   s = d - (w + R W) x t + R T,        R, t: sensor_from_mount
// and its pixel by  dq = (dq/dl) dl + (dq/dx) dx. So the joint covariance of (dl, r, s), lens parameters and six
// numbers more, holds all there is to know; it is formed once, and a pixel costs the product of two of its rows with
// it. At infinity only the rotation counts. It is what mrcal 2.2 reports (Kogan, "Projection uncertainty"), but for its
// regularisation: here priors count as observations.
//
// Independent of the gauge, and the same for every kind of sensor: of a projector it is where a point of the observed
// world is lit from. Errors of the sensor's own measurement (its noise at the pixel) are not in it.
// Linear, k = 1. A prior that is wrong, or a lens model that does not fit, is not in it either.
#pragma once

#include <optional>
#include <vector>

#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

class ProjectionUncertainty {
 public:
  // From the rig's covariance. Fails where it is empty or has no rows of the mount's datum: then the calibration is an
  // older one, or saw no body before this sensor's mount.
  static Expected<ProjectionUncertainty> create(const Rig& rig, std::size_t sensor);

  // Of a point in the sensor's frame, mm, or of a direction; none outside the lens's domain.
  std::optional<Eigen::Matrix2d> at_point(const Eigen::Vector3d& point_mm) const;
  std::optional<Eigen::Matrix2d> at_infinity(const Eigen::Vector3d& direction) const;
  // Of what a pixel sees at a distance from the centre of projection along its ray, which may be infinite; none where
  // the pixel has no ray.
  std::optional<Eigen::Matrix2d> at_pixel(const Eigen::Vector2d& pixel, double distance_mm) const;

  const Lens& lens() const { return lens_; }
  // Of the lens's parameters, then r and s above.
  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  ProjectionUncertainty(Lens lens, Eigen::MatrixXd covariance)
      : lens_(std::move(lens)), covariance_(std::move(covariance)) {}
  std::optional<Eigen::Matrix2d> at(const Eigen::Vector3d& point, bool infinite) const;

  Lens lens_;
  Eigen::MatrixXd covariance_;
};

// Standard uncertainty of a pixel in the direction in which it is largest: the root of the larger eigenvalue (mrcal's
// worstdirection-stdev).
double worst_direction_sigma(const Eigen::Matrix2d& covariance);

// A grid over a sensor's image, the outermost pixels included.
struct ProjectionUncertaintyMap {
  int columns = 0;
  int rows = 0;
  double distance_mm = 0;  // along the ray; may be infinite
  ImageSize size;
  std::vector<std::optional<Eigen::Matrix2d>> covariance_px2;  // row by row

  Eigen::Vector2d pixel(int column, int row) const;
  const std::optional<Eigen::Matrix2d>& at(int column, int row) const;
  std::optional<double> sigma_px(int column, int row) const;  // in the worst direction
};

// `columns` and `rows` at least 2. The same bits at any number of threads.
ProjectionUncertaintyMap projection_uncertainty_map(const ProjectionUncertainty& uncertainty, int columns, int rows,
                                                    double distance_mm, int threads);

}  // namespace crumple
