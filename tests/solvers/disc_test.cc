#include "solvers/disc.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "solvers/lens.h"
#include "tests/solvers/gradients.h"

namespace crumple {
namespace {

DiscOutline bent(const DiscOutline& outline) {
  DiscOutline image;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& p = outline[i];
    image[i] = Eigen::Vector2d(300 + 2 * p.x() - 0.5 * p.y(), 200 + 0.3 * p.x() + 1.5 * p.y()) / (1 + 0.02 * p.x());
  }
  return image;
}

TEST(Disc, CentroidOfAnUnbentOutlineIsItsCentre) { EXPECT_LT(centroid(disc_outline(3)).norm(), 1e-15); }

TEST(Disc, DerivativesMatchCentralDifferences) {
  const DiscOutline image = bent(disc_outline(5));
  const CentroidDerivative derivative = centroid_with_derivative(image);
  EXPECT_LT((derivative.centroid - centroid(image)).norm(), 1e-12);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const auto moved = [&](const Eigen::VectorXd& step) {
      DiscOutline at = image;
      at[i] += step;
      return Eigen::VectorXd(centroid(at));
    };
    const Eigen::MatrixXd numeric = central_differences(moved, Eigen::VectorXd::Zero(2));
    EXPECT_LT((numeric - derivative.d_vertex[i]).cwiseAbs().maxCoeff(), 1e-7) << i;
  }
}

// A plane tilted by 45 degrees, 500 mm away, under a lens with distortion, against the integral over the disc.
TEST(Disc, PredictsTheCentreOfGravityOfTheImage) {
  const Lens lens =
      Lens::create("LENSMODEL_OPENCV5", {1280, 960}, {1400, 1400, 640, 480, -0.2, 0.1, 1e-3, -1e-3, 0}).value();
  const double c = std::numbers::sqrt2 / 2;
  const auto in_camera = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector3d(110 + c * p.x(), 60 + p.y(), 500 + c * p.x());
  };
  Eigen::Matrix<double, 3, 2> in_plane;
  in_plane << c, 0, 0, 1, c, 0;
  for (const double radius : {2.0, 5.0, 10.0}) {
    constexpr int kRings = 200, kSpokes = 64;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    double area = 0;
    for (int i = 0; i < kRings * kSpokes; ++i) {
      const double r = radius * (i / kSpokes + 0.5) / kRings, angle = 2 * std::numbers::pi * (i % kSpokes) / kSpokes;
      const Projection at = lens.project_with_gradients(in_camera({r * std::cos(angle), r * std::sin(angle)})).value();
      const Eigen::Matrix2d d_plane = at.d_point * in_plane;
      const double weight = r * (d_plane(0, 0) * d_plane(1, 1) - d_plane(0, 1) * d_plane(1, 0));
      moment += weight * at.pixel;
      area += weight;
    }
    DiscOutline image = disc_outline(radius);
    for (Eigen::Vector2d& vertex : image) vertex = lens.project(in_camera(vertex)).value();
    const Eigen::Vector2d truth = moment / area;
    // What it would be to take the centre's image for it: 0.01 px at 2 mm, growing as the square.
    const double bias_px = (lens.project(in_camera({0, 0})).value() - truth).norm();
    EXPECT_GT(bias_px, 0.002 * radius * radius) << radius;
    // The outline's chords, straight in the image, leave a part that falls with the square of the number of vertices.
    EXPECT_LT((centroid(image) - truth).norm(), 0.002 * bias_px) << radius;
  }
}

}  // namespace
}  // namespace crumple
