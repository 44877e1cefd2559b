#include "solvers/lens.h"

#include <gtest/gtest.h>

#include "tests/solvers/gradients.h"

namespace crumple {
namespace {

const ImageSize kSize{1024, 768};

struct Case {
  const char* model;
  std::vector<double> parameters;
};

class LensModel : public testing::TestWithParam<Case> {
 protected:
  Lens lens() const { return Lens::create(GetParam().model, kSize, GetParam().parameters).value(); }
};

TEST_P(LensModel, ProjectionGradientsMatchCentralDifferences) {
  for (int gx = -3; gx <= 3; ++gx) {
    for (int gy = -3; gy <= 3; ++gy) {
      const Eigen::Vector3d point(gx * 80, gy * 60, 800);
      const Projection projection = lens().project_with_gradients(point);
      EXPECT_EQ(projection.pixel, lens().project(point));
      const auto of_point = [&](const Eigen::VectorXd& x) { return Eigen::VectorXd(lens().project(x)); };
      EXPECT_LT((central_differences(of_point, point, 1e-4) - projection.d_point).norm(), 1e-7);
      const auto of_parameters = [&](const Eigen::VectorXd& p) {
        return Eigen::VectorXd(lens().with_parameters({p.data(), p.data() + p.size()}).project(point));
      };
      const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(lens().parameters().data(), lens().parameter_count());
      EXPECT_LT((central_differences(of_parameters, p) - projection.d_parameters).norm(), 1e-6);
    }
  }
}

TEST_P(LensModel, RayComesBackToItsPixel) {
  for (int y = 0; y < kSize.height_px; y += 59) {
    for (int x = 0; x < kSize.width_px; x += 59) {
      const auto ray = lens().ray({x, y});
      ASSERT_TRUE(ray);
      EXPECT_LT((lens().project(*ray * 731) - Eigen::Vector2d(x, y)).norm(), 1e-9);
    }
  }
}

TEST_P(LensModel, RayGradientsMatchCentralDifferences) {
  const Eigen::Vector2d pixel(250, 610);
  const Ray ray = lens().ray_with_gradients(pixel).value();
  const auto of_pixel = [&](const Eigen::VectorXd& q) { return Eigen::VectorXd(lens().ray(q).value()); };
  EXPECT_LT((central_differences(of_pixel, pixel, 1e-5) - ray.d_pixel).norm(), 1e-9);
  const auto of_parameters = [&](const Eigen::VectorXd& p) {
    return Eigen::VectorXd(lens().with_parameters({p.data(), p.data() + p.size()}).ray(pixel).value());
  };
  const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(lens().parameters().data(), lens().parameter_count());
  EXPECT_LT((central_differences(of_parameters, p) - ray.d_parameters).norm(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(
    Models, LensModel,
    testing::Values(Case{"LENSMODEL_PINHOLE", {1400, 1410, 500, 390}},
                    Case{"LENSMODEL_OPENCV4", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3}},
                    Case{"LENSMODEL_OPENCV5", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3, 0.05}},
                    Case{"LENSMODEL_OPENCV8", {1400, 1410, 500, 390, -0.2, 0.1, 1e-3, -2e-3, 0.05, 0.1, -0.05, 0.02}}),
    [](const auto& lens_case) { return std::string(lens_case.param.model).substr(10); });

TEST(Lens, ProjectsAsItsFormulaSays) {
  // OpenCV's model by hand: x' = x (1 + k1 r^2), p = q = 0.
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", kSize, {1000, 1100, 500, 400, 0.1, 0, 0, 0}).value();
  const double x = 0.2, y = -0.1, radial = 1 + 0.1 * (x * x + y * y);
  const Eigen::Vector2d pixel = lens.project({x * 7, y * 7, 7});
  EXPECT_NEAR(pixel.x(), 1000 * x * radial + 500, 1e-10);
  EXPECT_NEAR(pixel.y(), 1100 * y * radial + 400, 1e-10);
}

TEST(Lens, HasNoRayBeyondTheFold) {
  // r (1 - r^2) turns back at r = 1/sqrt(3) and never exceeds 0.385.
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", kSize, {500, 500, 512, 384, -1, 0, 0, 0}).value();
  EXPECT_TRUE(lens.ray({512 + 150, 384}));
  EXPECT_FALSE(lens.ray({512 + 250, 384}));
}

TEST(Lens, RefusesWhatIsNoLens) {
  EXPECT_FALSE(Lens::create("LENSMODEL_OPENCV", kSize, {1, 1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {-1, 1, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", kSize, {1, NAN, 1, 1}));
  EXPECT_FALSE(Lens::create("LENSMODEL_PINHOLE", {0, 5}, {1, 1, 1, 1}));
}

TEST(RayTable, HoldsTheLensRays) {
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", {64, 48}, {90, 90, 30, 20, -0.1, 0.02, 0, 0}).value();
  const RayTable table(lens);
  EXPECT_TRUE(table.has(63, 47));
  EXPECT_EQ(table.at(63, 47), lens.ray({63, 47}).value());
}

}  // namespace
}  // namespace crumple
