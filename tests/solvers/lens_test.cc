#include "solvers/lens.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/solvers/gradients.h"

namespace crumple {
namespace {

const ImageSize kSize{1024, 768};
constexpr double kTolerance = 1e-8;

struct LensCase {
  const char* name;
  std::string model;
  std::vector<double> parameters;
};

// A splined lens whose control points lie anywhere, some percent of a focal length off.
LensCase splined(const char* name, const std::string& grid, double focal_px) {
  const std::string model = "LENSMODEL_SPLINED_STEREOGRAPHIC_" + grid;
  std::vector<double> parameters(lens_parameter_names(model).size());
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-0.02, 0.02);
  for (double& p : parameters) p = uniform(generator);
  parameters[0] = focal_px;
  parameters[1] = 1.01 * focal_px;
  parameters[2] = 500;
  parameters[3] = 390;
  return {name, model, parameters};
}

class LensModel : public testing::TestWithParam<LensCase> {
 protected:
  static Lens lens() { return Lens::create(GetParam().model, kSize, GetParam().parameters).value(); }
  static Eigen::VectorXd parameters() {
    return Eigen::Map<const Eigen::VectorXd>(GetParam().parameters.data(),
                                             static_cast<Eigen::Index>(GetParam().parameters.size()));
  }
  static Lens with(const Eigen::VectorXd& p) { return lens().with_parameters({p.data(), p.data() + p.size()}); }

  // Equal to the tolerance, relative to the column's largest entry where that is above one.
  static void expect_equal(const Eigen::MatrixXd& differences, const Eigen::MatrixXd& analytic, double unit) {
    ASSERT_EQ(differences.cols(), analytic.cols());
    for (int c = 0; c < analytic.cols(); ++c) {
      const double scale = std::max(unit, analytic.col(c).cwiseAbs().maxCoeff());
      EXPECT_LT((differences - analytic).col(c).cwiseAbs().maxCoeff(), kTolerance * scale) << "column " << c;
    }
  }
};

TEST_P(LensModel, ProjectionGradientsMatchDifferencesOverTheField) {
  int checked = 0;
  for (int y = 11; y < kSize.height_px; y += 140) {
    for (int x = 13; x < kSize.width_px; x += 197) {
      const auto ray = lens().ray({x, y});
      if (!ray) continue;
      const Eigen::Vector3d point = (400 + x) * ray->normalized();
      const Projection projection = lens().project_with_gradients(point).value();
      EXPECT_EQ(projection.pixel, lens().project(point).value());
      const auto of_point = [&](const Eigen::VectorXd& at) { return Eigen::VectorXd(lens().project(at).value()); };
      expect_equal(fourth_order_differences(of_point, point, 1e-4), projection.d_point, 1);
      const auto of_parameters = [&](const Eigen::VectorXd& p) {
        return Eigen::VectorXd(with(p).project(point).value());
      };
      expect_equal(fourth_order_differences(of_parameters, parameters(), 1e-3), projection.d_parameters, 1);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 36);
}

TEST_P(LensModel, RayComesBackToItsPixel) {
  for (int y = -40; y < kSize.height_px + 40; y += 82) {
    for (int x = -40; x < kSize.width_px + 40; x += 83) {
      const auto ray = lens().ray({x, y});
      ASSERT_TRUE(ray) << x << " " << y;
      EXPECT_LT((lens().project(*ray * 731).value() - Eigen::Vector2d(x, y)).norm(), 1e-9);
    }
  }
}

TEST_P(LensModel, RayGradientsMatchDifferencesOverTheField) {
  for (int y = 35; y < kSize.height_px; y += 230) {
    for (int x = 27; x < kSize.width_px; x += 320) {
      const Eigen::Vector2d pixel(x, y);
      const Ray ray = lens().ray_with_gradients(pixel).value();
      const auto of_pixel = [&](const Eigen::VectorXd& q) { return Eigen::VectorXd(lens().ray(q).value()); };
      expect_equal(fourth_order_differences(of_pixel, pixel, 3e-4), ray.d_pixel, 0);
      const auto of_parameters = [&](const Eigen::VectorXd& p) { return Eigen::VectorXd(with(p).ray(pixel).value()); };
      expect_equal(fourth_order_differences(of_parameters, parameters(), 2e-4), ray.d_parameters, 1);
    }
  }
}

TEST_P(LensModel, NamesEveryParameter) {
  EXPECT_EQ(lens_parameter_names(GetParam().model).size(), GetParam().parameters.size());
  EXPECT_THAT(lens_parameter_names(GetParam().model), testing::Not(testing::Contains("")));
}

INSTANTIATE_TEST_SUITE_P(
    Models, LensModel,
    testing::Values(
        LensCase{"Pinhole", "LENSMODEL_PINHOLE", {1400, 1410, 500, 390}},
        LensCase{"Opencv4", "LENSMODEL_OPENCV4", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3}},
        LensCase{"Opencv5", "LENSMODEL_OPENCV5", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3, 0.05}},
        LensCase{
            "Opencv8", "LENSMODEL_OPENCV8", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3, 0.05, 0.1, -0.05, 0.02}},
        LensCase{
            "StrongOpencv8", "LENSMODEL_OPENCV8", {800, 805, 500, 390, 0.9, 0.05, 1e-3, -2e-3, 0.002, 1.3, 0.25, 0.01}},
        LensCase{"Opencv12",
                 "LENSMODEL_OPENCV12",
                 {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3, 0.05, 0.1, -0.05, 0.02, 2e-3, 1e-3, -3e-3, 5e-4}},
        LensCase{"Cahvor", "LENSMODEL_CAHVOR", {1400, 1410, 500, 390, 0.02, -0.03, 0.01, -0.15, 0.08}},
        splined("Cubic", "order=3_Nx=11_Ny=9_fov_x_deg=50", 1400),
        splined("Quadratic", "order=2_Nx=9_Ny=8_fov_x_deg=55", 1400),
        splined("FarBehind", "order=3_Nx=16_Ny=14_fov_x_deg=260", 160)),
    [](const auto& lens_case) { return lens_case.param.name; });

TEST(Lens, ProjectsAsItsFormulaSays) {
  // OpenCV's model by hand: x' = x (1 + k1 r^2), p = q = 0.
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", kSize, {1000, 1100, 500, 400, 0.1, 0, 0, 0}).value();
  const double x = 0.2, y = -0.1, radial = 1 + 0.1 * (x * x + y * y);
  const Eigen::Vector2d pixel = lens.project({x * 7, y * 7, 7}).value();
  EXPECT_NEAR(pixel.x(), 1000 * x * radial + 500, 1e-10);
  EXPECT_NEAR(pixel.y(), 1100 * y * radial + 400, 1e-10);
}

TEST(Lens, ThinPrismIsOpencvs) {
  const Lens lens =
      Lens::create("LENSMODEL_OPENCV12", kSize, {1000, 1100, 500, 400, 0, 0, 0, 0, 0, 0, 0, 0, 1e-2, 2e-2, 3e-2, 4e-2})
          .value();
  const double x = 0.2, y = -0.1, s = x * x + y * y;
  const Eigen::Vector2d pixel = lens.project({x, y, 1}).value();
  EXPECT_NEAR(pixel.x(), 1000 * (x + 1e-2 * s + 2e-2 * s * s) + 500, 1e-10);
  EXPECT_NEAR(pixel.y(), 1100 * (y + 3e-2 * s + 4e-2 * s * s) + 400, 1e-10);
}

TEST(Lens, CahvorStretchesAcrossItsAxis) {
  const double alpha = 0.1, beta = -0.2, r0 = 0.02, r1 = -0.1, r2 = 0.05;
  const Lens lens = Lens::create("LENSMODEL_CAHVOR", kSize, {1000, 1100, 500, 400, alpha, beta, r0, r1, r2}).value();
  const Eigen::Vector3d axis(std::sin(alpha) * std::cos(beta), std::sin(beta), std::cos(alpha) * std::cos(beta));
  const Eigen::Vector3d point(30, 20, 100);
  const Eigen::Vector3d across = point - point.dot(axis) * axis;
  const double s = across.squaredNorm() / std::pow(point.dot(axis), 2);
  const Eigen::Vector3d moved = point + (r0 + r1 * s + r2 * s * s) * across;
  const Eigen::Vector2d pixel = lens.project(point).value();
  EXPECT_NEAR(pixel.x(), 1000 * moved.x() / moved.z() + 500, 1e-10);
  EXPECT_NEAR(pixel.y(), 1100 * moved.y() / moved.z() + 400, 1e-10);
}

TEST(Lens, AnUndistortedSplineIsStereographic) {
  const Lens lens = Lens::undistorted("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=12_Ny=12_fov_x_deg=220", kSize, 300,
                                      310, {500, 400})
                        .value();
  for (const double angle : {0.1, 1.0, 1.5, 1.7}) {  // up to 97 degrees off axis
    const Eigen::Vector3d point(0.6 * std::sin(angle), 0.8 * std::sin(angle), std::cos(angle));
    const Eigen::Vector2d pixel = lens.project(5 * point).value();
    EXPECT_NEAR(pixel.x(), 300 * 2 * std::tan(angle / 2) * 0.6 + 500, 1e-9);
    EXPECT_NEAR(pixel.y(), 310 * 2 * std::tan(angle / 2) * 0.8 + 400, 1e-9);
    const Eigen::Vector3d ray = lens.ray(pixel).value();
    EXPECT_LT((ray.normalized() - point).norm(), 1e-12);
    EXPECT_NEAR(point.z() > 0 ? ray.z() : ray.norm(), 1, 1e-12);
  }
  EXPECT_EQ(lens_parameter_names(lens.model())[4 + 2 * (3 * 12 + 5) + 1], "duy_5_3");
}

TEST(Lens, NothingBehindAPinholeIsSeen) {
  for (const char* model : {"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV12", "LENSMODEL_CAHVOR"}) {
    const Lens lens = Lens::undistorted(model, kSize, 1000, 1000, {500, 400}).value();
    EXPECT_TRUE(lens.project({1, 2, 3}));
    EXPECT_FALSE(lens.project({1, 2, -3}));
    EXPECT_FALSE(lens.project_with_gradients({1, 2, 0}));
    EXPECT_FALSE(lens.project({NAN, 2, 3}));
  }
}

TEST(Lens, SeesNothingBeyondTheFold) {
  // r (1 - r^2) turns back at r = 1/sqrt(3) and never exceeds 0.385.
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", kSize, {500, 500, 512, 384, -1, 0, 0, 0}).value();
  EXPECT_TRUE(lens.ray({512 + 150, 384}));
  EXPECT_TRUE(lens.ray({512 + 192, 384}));
  EXPECT_FALSE(lens.ray({512 + 250, 384}));
  EXPECT_TRUE(lens.project({0.577, 0, 1}));
  EXPECT_FALSE(lens.project({0.578, 0, 1}));
}

TEST(Lens, CanBeFollowedPastItsFold) {
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", kSize, {500, 500, 512, 384, -1, 0, 0, 0}).value();
  const Lens followed = lens.past_folds().with_parameters({400, 400, 512, 384, -1, 0, 0, 0});
  const Eigen::Vector2d pixel = followed.project({0.8, 0, 1}).value();
  EXPECT_NEAR(pixel.x(), 512 + 400 * (0.8 - 0.512), 1e-9);
  EXPECT_EQ(followed.project_with_gradients({0.8, 0, 1}).value().pixel, pixel);
  EXPECT_FALSE(followed.within_folds().project({0.8, 0, 1}));
  // A pixel's ray stays the one on this side.
  EXPECT_EQ(lens.past_folds().ray({512 + 150, 384}).value(), lens.ray({512 + 150, 384}).value());
  EXPECT_FALSE(lens.past_folds().ray({512 + 250, 384}));
  // Its start, the undistorted ray, lies past the fold.
  const Lens spread = Lens::create("LENSMODEL_OPENCV5", kSize, {500, 500, 512, 384, 0.5, -0.1, 0, 0, 0}).value();
  const double fold = spread.domain().largest_slope();
  for (const double share : {0.7, 0.85, 0.99}) {
    const Eigen::Vector3d direction(share * fold, 0, 1);
    const Eigen::Vector2d seen = spread.project(direction).value();
    EXPECT_LT((spread.past_folds().ray(seen).value() - direction).norm(), 1e-8) << share;
  }
  const Lens pole = Lens::create("LENSMODEL_OPENCV8", kSize, {500, 500, 512, 384, 0, 0, 0, 0, 0, -1, 0, 0}).value();
  EXPECT_FALSE(pole.past_folds().project({1.001, 0, 1}));
}

TEST(Lens, SeesNothingBeyondThePoleOfARationalLens) {
  // 1 - r^2 in the denominator.
  const Lens lens = Lens::create("LENSMODEL_OPENCV8", kSize, {500, 500, 512, 384, 0, 0, 0, 0, 0, -1, 0, 0}).value();
  EXPECT_TRUE(lens.project({0.999, 0, 1}));
  EXPECT_FALSE(lens.project({1.001, 0, 1}));
  EXPECT_NEAR(lens.ray({512 + 50000, 384}).value().x(), 0.995, 1e-3);
}

TEST(Lens, TheControlPointsBoundASplinedLens) {
  const Lens cubic =
      Lens::undistorted("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=6_fov_x_deg=60", kSize, 1000, 1000, {500, 400})
          .value();
  const double half = 30 * std::numbers::pi / 180;
  EXPECT_TRUE(cubic.project({std::tan(half - 1e-6), 0, 1}));
  EXPECT_FALSE(cubic.project({std::tan(half + 1e-6), 0, 1}));
  EXPECT_FALSE(cubic.ray({500 + 1000 * 2 * std::tan(half / 2) + 1, 400}));
  EXPECT_FALSE(cubic.project({0, 0, -1}));
}

TEST(Lens, RefusesWhatIsNoLens) {
  EXPECT_FALSE(Lens::create("LENSMODEL_OPENCV", kSize, {1, 1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {-1, 1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {1, NAN, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", {0, 5}, {1, 1, 1, 1}));
  for (const char* grid :
       {"", "_order=4_Nx=8_Ny=8_fov_x_deg=60", "_order=3_Nx=3_Ny=8_fov_x_deg=60", "_order=3_Nx=8_Ny=8_fov_x_deg=0",
        "_order=3_Nx=8_Ny=8_fov_x_deg=360", "_order=3_Nx=65535_Ny=65535_fov_x_deg=60",
        "_order=3_Nx=8_Ny=8_fov_x_deg=60x", "_order=3_Nx=08_Ny=8_fov_x_deg=60"}) {
    const std::string model = std::string("LENSMODEL_SPLINED_STEREOGRAPHIC") + grid;
    EXPECT_FALSE(Lens::undistorted(model, kSize, 1000, 1000, {500, 400})) << model;
    EXPECT_TRUE(lens_parameter_names(model).empty()) << model;
  }
}

// Radial terms of any size: every direction of the domain is found again from its pixel.
RC_GTEST_PROP(Lens, TheRayOfAnyDirectionInTheDomainIsFound, ()) {
  const auto number = [](double largest) { return *rc::gen::inRange(-1000, 1001) * largest / 1000; };
  const Lens lens =
      Lens::create("LENSMODEL_OPENCV8", kSize,
                   {800, 820, 500, 400, number(2), number(1), 0, 0, number(0.5), number(2), number(1), number(0.5)})
          .value();
  const double slope = 0.97 * std::min(lens.domain().largest_slope(), 3.0) * *rc::gen::inRange(1, 1001) / 1000;
  const double angle = number(3.14);
  const Eigen::Vector3d direction(slope * std::cos(angle), slope * std::sin(angle), 1);
  const auto ray = lens.ray(lens.project(direction).value());
  RC_ASSERT(ray.has_value());
  RC_ASSERT((*ray - direction).norm() < 1e-6);
}

TEST(RayTable, HoldsTheLensRays) {
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", {64, 48}, {90, 90, 30, 20, -0.1, 0.02, 0, 0}).value();
  const RayTable table(lens);
  EXPECT_TRUE(table.has(63, 47));
  EXPECT_EQ(table.at(63, 47), lens.ray({63, 47}).value());
}

}  // namespace
}  // namespace crumple
