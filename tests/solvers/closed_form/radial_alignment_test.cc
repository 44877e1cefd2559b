#include "solvers/closed_form/radial_alignment.h"

#include <cmath>

#include <gtest/gtest.h>

namespace crumple {
namespace {

const Eigen::Vector2d kCentre(511.5, 383.5);

// g(r) = a0 + a2 r^2 + a4 r^4, px. The first bends as much as a lens of 110 degrees.
struct RadialLens {
  double a0, a2, a4;

  double g(double r) const { return a0 + a2 * r * r + a4 * r * r * r * r; }

  // The radius whose ray has the slope `tangent`: r / g(r) grows with r.
  double radius(double tangent) const {
    double low = 0, high = 1000;
    for (int i = 0; i < 100; ++i) {
      const double r = 0.5 * (low + high);
      (r < tangent * g(r) ? low : high) = r;
    }
    return low;
  }

  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d xy = p.head<2>();
    return kCentre + radius(xy.norm() / p.z()) / xy.norm() * xy;
  }
};

const RadialLens kBent{520, -3.5e-4, -2e-10};
const RadialLens kPinhole{900, 0, 0};

PlaneView seen(const RadialLens& lens, const Pose& pose) {
  PlaneView view;
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      const Eigen::Vector3d p(50.0 * x - 190, 50.0 * y - 160, 0);
      view.plane_mm.emplace_back(p.head<2>());
      view.pixels.push_back(lens.project(pose * p));
    }
  }
  return view;
}

std::vector<Pose> tilted_poses() {
  std::vector<Pose> poses;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d turn(0.5 * std::cos(0.8 * i), 0.6 * std::sin(0.8 * i), 0.4 * i);
    poses.push_back({rotation_from_vector(turn), {60 * std::cos(2.0 * i), 50 * std::sin(1.7 * i), 420 + 15.0 * i}});
  }
  return poses;
}

void expect_recovered(const RadialLens& lens, const std::vector<Pose>& poses, double tolerance) {
  std::vector<PlaneView> views;
  for (const Pose& pose : poses) views.push_back(seen(lens, pose));
  const auto found = align_radially(kCentre, views);
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_TRUE((*found)[i]) << i;
    const Vector6d step = local_step(*(*found)[i], poses[i]);
    EXPECT_LT(step.head<3>().norm(), tolerance) << i;
    EXPECT_LT(step.tail<3>().norm(), 1e3 * tolerance) << i;
  }
}

TEST(RadialAlignment, RecoversPosesBehindAStronglyBendingLens) { expect_recovered(kBent, tilted_poses(), 1e-9); }

TEST(RadialAlignment, RecoversPosesBehindAPinhole) { expect_recovered(kPinhole, tilted_poses(), 1e-9); }

// The constraint knows of a tilt through its square: of none, half the digits.
TEST(RadialAlignment, RecoversAPlaneParallelToTheImageBesideTiltedOnes) {
  std::vector<Pose> poses = tilted_poses();
  poses.push_back({Eigen::Quaterniond::Identity(), {5, -7, 400}});
  expect_recovered(kBent, poses, 1e-6);
}

TEST(RadialAlignment, RefusesPlanesParallelToTheImage) {
  std::vector<PlaneView> views;
  for (int i = 0; i < 4; ++i) {
    views.push_back(seen(kBent, {rotation_from_vector({0, 0, 0.3 * i}), {10.0 * i, 0, 400 + 40.0 * i}}));
  }
  EXPECT_FALSE(align_radially(kCentre, views));
}

TEST(RadialAlignment, PassesOverAViewThatTellsNothing) {
  std::vector<PlaneView> views;
  for (const Pose& pose : tilted_poses()) views.push_back(seen(kBent, pose));
  PlaneView& line = views[2];
  line.plane_mm.resize(9);  // the first row
  line.pixels.resize(9);
  PlaneView& few = views[5];
  few.plane_mm.resize(5);
  few.pixels.resize(5);
  const auto found = align_radially(kCentre, views);
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t i = 0; i < views.size(); ++i) EXPECT_EQ((*found)[i].has_value(), i != 2 && i != 5) << i;
}

}  // namespace
}  // namespace crumple
