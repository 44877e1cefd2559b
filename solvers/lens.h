// A lens: how a point in a sensor's frame becomes a pixel, and which ray a pixel sees.
//
// Frame: x right, y down, z forward, mm. Pixel (0,0) is the centre of the top-left pixel. A projector's lens is the
// same thing with light going the other way. Models are mrcal's, by its names, with analytic gradients: OpenCV's
// family by solvers/opencv_model.h, the others by libmrcal.
//   LENSMODEL_PINHOLE    fx fy cx cy
//   LENSMODEL_OPENCV4    + k1 k2 p1 p2, _OPENCV5 + k3, _OPENCV8 + k4 k5 k6 (the denominator), _OPENCV12 + s1 s2 s3 s4
//   LENSMODEL_CAHVOR     fx fy cx cy, direction of the axis of symmetry alpha beta (rad), radial r0 r1 r2
//   LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=11_Ny=8_fov_x_deg=60
//                        fx fy cx cy, then dux_0_0 duy_0_0 dux_1_0 ..., the control points of column and row that shift
//                        the stereographic coordinates u = 2 tan(theta / 2) before pixel = f u + c. Order 2 or 3.
// fx, fy are px per unit of slope at the axis of a lens without its further terms. CAHVOR's r0 and a splined lens's
// control points scale the image too: there they are not the lens's focal length.
//
// Validity: a model's domain is that of solvers/lens_domain.h; a point outside has no projection. Ray computation
// inverts the projection by iteration; where no point of the domain comes to the pixel within 1e-6 px there is no ray.
// The gradients of a splined lens are held densely, though 32 columns at most are not zero.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/lens_domain.h"

namespace crumple {

struct ImageSize {
  int width_px = 0;
  int height_px = 0;
  bool operator==(const ImageSize&) const = default;
  // Integers are the middles of pixels.
  bool contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= width_px - 0.5 && pixel.y() <= height_px - 0.5;
  }
};

using Matrix2x3d = Eigen::Matrix<double, 2, 3>;
using Matrix2Xd = Eigen::Matrix<double, 2, Eigen::Dynamic>;

struct Projection {
  Eigen::Vector2d pixel;
  Matrix2x3d d_point;      // with respect to the point in the sensor's frame
  Matrix2Xd d_parameters;  // with respect to the lens parameters, in their order
};

// The ray of a pixel in the sensor's frame: (x, y, 1), or a unit vector where it points sideways or back (z <= 0),
// which a wide splined lens can see.
struct Ray {
  Eigen::Vector3d direction;
  Eigen::Matrix<double, 3, Eigen::Dynamic> d_parameters;  // row 2 is zero for (x, y, 1)
  Eigen::Matrix<double, 3, 2> d_pixel;                    // likewise
};

// Where the control points of a splined lens stand, in stereographic coordinates; empty for other models.
struct SplineGrid {
  std::vector<double> x;
  std::vector<double> y;
};

class Lens {
 public:
  // Fails on an unknown model name, a wrong number of parameters, a non-finite one or a focal length that is not
  // positive.
  static Expected<Lens> create(const std::string& model, ImageSize size, std::vector<double> parameters);

  // Undistorted, with the given focal length and principal point; the model's further parameters are zero, which makes
  // a splined lens stereographic.
  static Expected<Lens> undistorted(const std::string& model, ImageSize size, double focal_x_px, double focal_y_px,
                                    Eigen::Vector2d principal_point_px);

  const std::string& model() const { return model_; }
  ImageSize size() const { return size_; }
  const std::vector<double>& parameters() const { return parameters_; }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  bool splined() const;
  SplineGrid spline_grid() const;

  // Same model and size with other numbers. Asserts on their count; finite values are the caller's business.
  Lens with_parameters(std::vector<double> parameters) const;

  // The same lens, projecting where the formula of OpenCV's family goes on past its fold, and back. The way from a
  // start to a lens that does not fold may lead through lenses that do, and ends at a corner beyond the fold otherwise.
  // No light takes that way: what a refinement arrives at is for the lens within its folds to judge. Rays stay those
  // within the fold, and so does the domain; other models are the same.
  Lens past_folds() const;
  Lens within_folds() const;

  // No value outside the domain, but as past_folds() says.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<Projection> project_with_gradients(const Eigen::Vector3d& point) const;
  // The same into the caller's memory, false outside the domain: the derivatives of the pixel's coordinates by the lens
  // parameters go to d_u and d_v.
  bool project_into(const Eigen::Vector3d& point, Eigen::Vector2d& pixel, Matrix2x3d& d_point, double* d_u,
                    double* d_v) const;

  // No value where the pixel has no ray.
  std::optional<Eigen::Vector3d> ray(const Eigen::Vector2d& pixel) const;
  // Derivatives by the implicit function theorem from those of project.
  std::optional<Ray> ray_with_gradients(const Eigen::Vector2d& pixel) const;

  const LensDomain& domain() const { return domain_; }

 private:
  struct Model;
  // As project_into, wherever the formula leads.
  void follow(const Eigen::Vector3d& point, Eigen::Vector2d& pixel, Matrix2x3d& d_point, double* d_u,
              double* d_v) const;
  Lens(std::string model, ImageSize size, std::shared_ptr<const Model> shared, std::vector<double> parameters,
       bool past_folds = false);

  std::string model_;
  ImageSize size_;
  std::vector<double> parameters_;
  std::shared_ptr<const Model> shared_;
  bool past_folds_;
  LensDomain domain_;
  LensDomain projected_;  // the domain, or further
};

// "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"...: names of the parameters in mrcal's order. Empty where there
// is no such model.
std::vector<std::string> lens_parameter_names(const std::string& model);

// The models there are, for messages: "LENSMODEL_PINHOLE, LENSMODEL_OPENCV4, ...".
const char* lens_model_choices();

// Rays of all pixel centres of a sensor, row by row: (x, y) of (x, y, 1); NaN where there is none, or it points
// sideways or back. Computed once per sensor because the inverse is slow.
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
