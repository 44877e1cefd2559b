#include "solvers/closed_form/triangulate.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple {
namespace {

using testing::HasSubstr;

Lens made_lens() {
  return *Lens::create("LENSMODEL_OPENCV5", {1280, 1024}, {1500, 1500, 640, 512, -0.1, 0.05, 1e-4, -1e-4, 0});
}

// A sensor at `place_mm` whose optical axis goes through the origin of the world.
Pose looking_at_origin(const Eigen::Vector3d& place_mm) {
  Eigen::Matrix3d axes;
  axes.row(2) = -place_mm.normalized();
  axes.row(0) = Eigen::Vector3d::UnitY().cross(Eigen::Vector3d(axes.row(2))).normalized();
  axes.row(1) = Eigen::Vector3d(axes.row(2)).cross(Eigen::Vector3d(axes.row(0)));
  const Eigen::Quaterniond rotation(axes);
  return {rotation, -(rotation * place_mm)};
}

std::vector<Sighting> sightings_of(const Lens& lens, const std::vector<Eigen::Vector3d>& places,
                                   const Eigen::Vector3d& point_mm) {
  std::vector<Sighting> sightings;
  for (const Eigen::Vector3d& place : places) {
    const Pose sensor_from_world = looking_at_origin(place);
    sightings.push_back({&lens, sensor_from_world, lens.project(sensor_from_world * point_mm).value()});
  }
  return sightings;
}

const std::vector<Eigen::Vector3d> kPlaces{{-1000, 0, -3000}, {1000, 100, -3000}, {0, -800, -2500}};

TEST(Triangulate, ExactPixelsGiveThePoint) {
  const Lens lens = made_lens();
  const Eigen::Vector3d truth(120, -80, 200);
  for (const std::size_t sensors : {2u, 3u}) {
    const auto found = triangulate(sightings_of(lens, {kPlaces.begin(), kPlaces.begin() + sensors}, truth));
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_LT((found->point_mm - truth).norm(), 1e-8);
    EXPECT_LT(found->chi_square, 1e-12);
  }
}

TEST(Triangulate, CovarianceCoversTheError) {
  const Lens lens = made_lens();
  const Eigen::Vector3d truth(120, -80, 200);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.1);
  int inside = 0;
  constexpr int kTrials = 500;
  double chi_squares = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto sightings = sightings_of(lens, kPlaces, truth);
    for (Sighting& s : sightings) {
      s.pixel += Eigen::Vector2d(noise(random), noise(random));
      s.covariance_px2 *= 0.01;
    }
    const auto found = triangulate(sightings);
    ASSERT_TRUE(found);
    const Eigen::Vector3d error = found->point_mm - truth;
    inside += error.dot(found->covariance_mm2.inverse() * error) < 7.815;  // 95 % in three dimensions
    chi_squares += found->chi_square;
  }
  EXPECT_NEAR(inside / double(kTrials), 0.95, 0.03);
  EXPECT_NEAR(chi_squares / kTrials, 3, 0.35);  // six residuals, three unknowns
}

TEST(Triangulate, RefusesByName) {
  const Lens lens = made_lens();
  auto sightings = sightings_of(lens, kPlaces, {0, 0, 0});
  EXPECT_THAT(triangulate({sightings[0]}).error().message, HasSubstr("at least two sensors"));
  EXPECT_THAT(triangulate({sightings[0], sightings[0]}).error().message, HasSubstr("parallel"));
  const auto barely = sightings_of(lens, {{0, 0, -3000}, {0.5, 0, -3000}}, {0, 0, 0});
  EXPECT_THAT(triangulate(barely).error().message, HasSubstr("nearly parallel"));
  Sighting left{&lens, {}, {100, 512}}, right{&lens, {}, {1100, 512}};
  right.sensor_from_world.translation.x() = -500;  // 500 mm to the right, looking further right: they part
  EXPECT_THAT(triangulate({left, right}).error().message, HasSubstr("behind a sensor"));
}

}  // namespace
}  // namespace crumple
