// A lens: how a point in a sensor's frame becomes a pixel, and which ray a pixel sees.
//
// Frame: x right, y down, z forward, mm. Pixel (0,0) is the centre of the top-left pixel. A projector's lens is the
// same thing with light going the other way. Models are mrcal's, by its names, with analytic gradients (OpenCV's family
// in solvers/opencv_model.h, equal to libmrcal's to rounding): LENSMODEL_PINHOLE (fx fy cx cy), LENSMODEL_OPENCV4 (+ k1
// k2 p1 p2), _OPENCV5 (+ k3), _OPENCV8 (+ k4 k5 k6).
//
// Validity: z > 0. Ray computation inverts the distortion by iteration; where it does not come back to the pixel to
// 1e-6 px (beyond the fold of a polynomial distortion) there is no ray, and the functions say so.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

struct ImageSize {
  int width_px = 0;
  int height_px = 0;
  bool operator==(const ImageSize&) const = default;
};

using Matrix2x3d = Eigen::Matrix<double, 2, 3>;
using Matrix2Xd = Eigen::Matrix<double, 2, Eigen::Dynamic>;

struct Projection {
  Eigen::Vector2d pixel;
  Matrix2x3d d_point;      // with respect to the point in the sensor's frame
  Matrix2Xd d_parameters;  // with respect to the lens parameters, in their order
};

// The ray of a pixel as (x, y, 1) in the sensor's frame.
struct Ray {
  Eigen::Vector3d direction;
  Eigen::Matrix<double, 3, Eigen::Dynamic> d_parameters;  // row 2 is zero
  Eigen::Matrix<double, 3, 2> d_pixel;                    // row 2 is zero
};

class Lens {
 public:
  // Fails on an unknown model name, a wrong number of parameters, a non-finite one or a focal length that is not
  // positive.
  static Expected<Lens> create(const std::string& model, ImageSize size, std::vector<double> parameters);

  // Undistorted, with the given focal length and principal point; the model's further parameters are zero.
  static Expected<Lens> undistorted(const std::string& model, ImageSize size, double focal_x_px, double focal_y_px,
                                    Eigen::Vector2d principal_point_px);

  const std::string& model() const { return model_; }
  ImageSize size() const { return size_; }
  const std::vector<double>& parameters() const { return parameters_; }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }

  // Same model and size with other numbers. Asserts on their count; finite values are the caller's business.
  Lens with_parameters(std::vector<double> parameters) const;

  // Precondition: the point lies in front of the sensor (z > 0).
  Eigen::Vector2d project(const Eigen::Vector3d& point) const;
  Projection project_with_gradients(const Eigen::Vector3d& point) const;
  // The same into the caller's memory: derivatives of the pixel's coordinates by the lens parameters go to d_u and d_v.
  Eigen::Vector2d project_into(const Eigen::Vector3d& point, Matrix2x3d& d_point, double* d_u, double* d_v) const;

  // No value where the pixel has no ray (see above).
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& pixel) const;
  // Derivatives by the implicit function theorem from those of project.
  std::optional<Ray> ray_with_gradients(const Eigen::Vector2d& pixel) const;

 private:
  struct Model;
  Lens(std::string model, ImageSize size, std::shared_ptr<const Model> shared);

  std::string model_;
  ImageSize size_;
  std::vector<double> parameters_;
  std::shared_ptr<const Model> shared_;
};

// "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"...: names of the parameters in mrcal's order.
std::vector<std::string> lens_parameter_names(const std::string& model);

// Rays of all pixel centres of a sensor, row by row: (x, y) of (x, y, 1); NaN where there is none. Computed once per
// sensor because the inverse is slow.
class RayTable {
 public:
  explicit RayTable(const Lens& lens);
  bool has(int x, int y) const;
  Eigen::Vector3d at(int x, int y) const;

 private:
  std::size_t index(int x, int y) const;

  int width_px_;
  std::vector<Eigen::Vector2d> rays_;
};

}  // namespace crumple
