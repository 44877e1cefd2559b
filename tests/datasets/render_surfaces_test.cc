#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "datasets/render/surfaces.h"

namespace crumple {
namespace {

Panel door() {
  PanelShape shape;
  shape.size_mm = {560, 420};
  shape.curvature_per_mm = {1 / 2600.0, 1 / 1100.0};
  shape.creases = {{{0, -105}, 0.05, 0.23, 7}};
  shape.recesses = {{{150, 10}, {66, 34}, 16}};
  shape.dents = {{{-130, 55}, 24, 0.9}};
  shape.presses = {{{20, 60}, 1.3, 90, 40, 12, 0}, {{-60, -20}, 0.4, 70, 30, 6, 5}};
  return {shape, Material{}};
}

Eigen::Vector2d random_place(const Extent& extent, double border, std::mt19937& generator) {
  std::uniform_real_distribution<double> share(0, 1);
  const Eigen::Vector2d room = extent.high - extent.low - Eigen::Vector2d::Constant(2 * border);
  return extent.low + Eigen::Vector2d(border + share(generator) * room.x(), border + share(generator) * room.y());
}

TEST(RenderSurfaces, slope_is_the_derivative_of_height) {
  const Panel panel = door();
  std::mt19937 generator(1);
  constexpr double h = 1e-4;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d p = random_place(panel.extent(), 1, generator);
    const Eigen::Vector2d slope = panel.slope(p.x(), p.y());
    EXPECT_NEAR(slope.x(), (panel.height_mm(p.x() + h, p.y()) - panel.height_mm(p.x() - h, p.y())) / (2 * h), 1e-7);
    EXPECT_NEAR(slope.y(), (panel.height_mm(p.x(), p.y() + h) - panel.height_mm(p.x(), p.y() - h)) / (2 * h), 1e-7);
  }
}

TEST(RenderSurfaces, distance_is_zero_on_the_surface_and_the_offset_off_it) {
  const Panel panel = door();
  std::mt19937 generator(2);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d p = random_place(panel.extent(), 6, generator);
    const SurfacePoint on = panel.at(p.x(), p.y());
    EXPECT_NEAR(panel.distance_mm(on.position_mm), 0, 1e-12);
    for (const double offset : {-2.0, -0.01, 0.01, 3.0}) {
      EXPECT_NEAR(panel.distance_mm(on.position_mm + offset * on.normal), offset, 1e-8) << p.transpose();
    }
  }
}

// Against the smallest distance to a fine grid, for points that may be far away.
TEST(RenderSurfaces, nearest_point_is_the_nearest_of_all) {
  const Panel panel = door();
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> depth(-60, 60);
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d p = random_place(panel.extent(), -40, generator);
    const Eigen::Vector3d point(p.x(), p.y(), panel.height_mm(p.x(), p.y()) + depth(generator));
    double smallest = 1e9;
    for (double y = -210; y <= 210; y += 1) {
      for (double x = -280; x <= 280; x += 1) {
        smallest = std::min(smallest, (Eigen::Vector3d(x, y, panel.height_mm(x, y)) - point).norm());
      }
    }
    const double found = (panel.nearest(point) - point).norm();
    EXPECT_LE(found, smallest + 1e-9) << point.transpose();
    EXPECT_GT(found, smallest - 0.6);
  }
}

TEST(RenderSurfaces, ray_meets_the_exact_surface) {
  const Panel panel = door();
  const Eigen::Vector3d origin(40, 20, -800);
  const Eigen::Vector3d target = panel.at(120, 25).position_mm;
  const Eigen::Vector3d direction = (target - origin).normalized();
  const double distance = (target - origin).norm();
  const auto t = panel.meet(origin, direction, distance + 0.7);
  ASSERT_TRUE(t);
  EXPECT_NEAR(*t, distance, 1e-9);
  EXPECT_FALSE(panel.meet(origin, direction, distance - 300));
}

TEST(RenderSurfaces, a_press_has_its_depth_and_its_length) {
  PanelShape shape;
  shape.presses = {{{10, 20}, M_PI / 2, 100, 30, 8, 0}, {{-200, 0}, 0, 60, 20, 5, 4}};
  const Panel panel(shape, {});
  EXPECT_NEAR(panel.height_mm(10, 20), 8, 1e-9);
  EXPECT_NEAR(panel.height_mm(40, 20), 8 * std::exp(-1), 1e-9);
  EXPECT_NEAR(panel.height_mm(10, 120), 8 * std::exp(-1), 1e-9);
  EXPECT_NEAR(panel.height_mm(-200, 3), 5 * std::exp(-(5.0 - 4) / 20), 1e-9);
}

TEST(RenderSurfaces, a_car_before_and_after_differs_where_it_was_hit) {
  const Panel before(car_side({4000, 1200}), {});
  PanelShape shape = before.shape();
  shape.dents.push_back({{300, 50}, 80, 20});
  const Panel after(shape, {});
  EXPECT_EQ(before.extent().high, Eigen::Vector2d(2000, 600));
  EXPECT_NEAR(after.height_mm(300, 50) - before.height_mm(300, 50), 20, 1e-9);
  EXPECT_EQ(after.height_mm(-1500, 50), before.height_mm(-1500, 50));
}

TEST(RenderSurfaces, balls_are_round) {
  const Balls bar(25, {{-150, 0}, {150, 10}}, Material{});
  EXPECT_NEAR(bar.height_mm(-150, 0), -25, 1e-12);
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d offset = 17 * Eigen::Vector2d(share(generator), share(generator));
    const Eigen::Vector2d p = Eigen::Vector2d(150, 10) + offset;
    ASSERT_TRUE(bar.exists(p.x(), p.y()));
    const SurfacePoint on = bar.at(p.x(), p.y());
    const Eigen::Vector3d centre(150, 10, 0);
    EXPECT_NEAR((on.position_mm - centre).norm(), 25, 1e-9);
    EXPECT_LT((on.normal - (on.position_mm - centre) / 25).norm(), 1e-9);
    EXPECT_NEAR(bar.distance_mm(on.position_mm + 2 * on.normal), 2, 1e-7);
  }
  EXPECT_FALSE(bar.exists(0, 0));
  EXPECT_TRUE(std::isfinite(bar.height_mm(0, 0)));
  EXPECT_FALSE(bar.meet({0, 5, -500}, {0, 0, 1}, 500 + bar.height_mm(0, 5)));
}

TEST(RenderSurfaces, plate_has_squares_and_a_margin) {
  const BoardPlate plate(Target{9, 6, 20}, {0.2, -0.1}, 10, Material{0.9, 0, 1}, Material{0.1, 0, 1});
  EXPECT_EQ(plate.material(-5, -5).albedo, 0.1);
  EXPECT_EQ(plate.material(5, -5).albedo, 0.9);
  EXPECT_EQ(plate.material(5, 5).albedo, 0.1);
  EXPECT_EQ(plate.material(-25, -5).albedo, 0.9);
  EXPECT_EQ(plate.extent().low, Eigen::Vector2d(-30, -30));
  EXPECT_EQ(plate.extent().high, Eigen::Vector2d(190, 130));
  const Eigen::Vector3d corner = plate.board().point(13);
  EXPECT_NEAR(plate.distance_mm(corner), 0, 1e-12);
}

}  // namespace
}  // namespace crumple
