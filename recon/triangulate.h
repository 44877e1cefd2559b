// Where a camera ray meets a stripe's surface of light.
//
// The light of one stripe coordinate s leaves the projector on the surface {X : n . lens(proj_from_cam X) = s}, a plane
// if the lens has no distortion. On the ray X = depth * (x, y, 1), depth is found by Newton's method from that plane.
// Frames: the ray and depth in the camera's frame; depth is the camera's z, mm.
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

struct StripeDepth {
  double depth_mm = 0;
  double d_depth_d_coordinate = 0;  // mm per projector px; its sign is kept
};

class StripeTriangulator {
 public:
  // `normal` is the orientation's n in the projector's pixel plane.
  StripeTriangulator(const Lens& projector, const Pose& proj_from_cam, const Eigen::Vector2d& normal);

  // No value where the ray does not meet the light in front of both sensors, or runs (nearly) within it: then the
  // coordinate says nothing of depth.
  std::optional<StripeDepth> operator()(const Eigen::Vector3d& ray, double coordinate_px) const;

  // n . lens(proj_from_cam (depth ray)); no value where the projector does not light the point.
  std::optional<double> coordinate_px(const Eigen::Vector3d& ray, double depth_mm) const;

 private:
  double plane_depth(const Eigen::Vector3d& ray, double coordinate_px) const;

  Lens projector_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  Eigen::Vector2d normal_;
};

// One pixel's depth out of several orientations.
struct DepthReading {
  double depth_mm = 0;
  double d_depth_d_coordinate = 0;  // mm per px
  double sigma_px = 0;              // of the coordinate, from decoding
};

struct CombinedDepth {
  double depth_mm = 0;
  double sigma_mm = 0;  // from decoding alone
  double quality = 0;   // 0..1: 1 where chi-square is within its degrees of freedom; 0.5 with a single reading
  int used = 0;         // readings that went in
};

// The plain average (the paper's rule). Precondition: at least one reading.
CombinedDepth average_depth(std::span<const DepthReading> readings);

// Weighted by what each reading knows of depth, 1 / (d_depth_d_coordinate^2 (sigma^2 + common^2)); `common_sigma_px` is
// what calibration may be off by, which no reading can know better than. The reading that disagrees most is dropped
// while chi-square exceeds `gate` per degree of freedom and three or more are left; two that disagree give no value,
// since nothing tells which is wrong. Precondition: at least one reading.
std::optional<CombinedDepth> weighted_depth(std::span<const DepthReading> readings, double common_sigma_px,
                                            double gate);

}  // namespace crumple
