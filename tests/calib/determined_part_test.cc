#include "calib/determined_part.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

using testing::Contains;

// One camera before boards at five places, none of them tilted.
CalibrationData with_parallel_boards() {
  Synthetic made = make_synthetic({.placements = 5});
  std::mt19937 random(3);
  std::normal_distribution<double> noise_px(0, 0.05);
  for (std::size_t p = 0; p < 5; ++p) {
    Pose& pose = made.truth.world_from_board[p];
    pose = {Eigen::Quaterniond::Identity(),
            {-160.0 + 12.0 * static_cast<double>(p), -120, 750.0 + 30.0 * static_cast<double>(p)}};
    CornerView& view = made.observations.corners[p];
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      view.pixels[i] = *made.truth.rig.sensors[0].lens.project(pose * made.truth.boards[0].point(view.corners[i]));
      for (double& coordinate : view.pixels[i]) coordinate += noise_px(random);
    }
  }
  CalibrationData data = data_of(made);
  data.sensors.resize(1);
  data.pairs.clear();
  data.observations.stripes.clear();
  data.observations.features.clear();
  return data;
}

TEST(DeterminedPart, OfParallelBoardsIsWhatIsSeenAtTheirDistance) {
  const CalibrationData data = with_parallel_boards();
  ASSERT_FALSE(calibrate(data, {}));
  const auto part = determined_part(data, {});
  ASSERT_TRUE(part);
  EXPECT_THAT(part->open, Contains("cam0.fx"));
  ASSERT_EQ(part->projections.size(), 1U);
  const DeterminedProjection& cam0 = part->projections.front();
  EXPECT_EQ(cam0.sensor, "cam0");
  EXPECT_LT(cam0.there_px, 0.5);
  EXPECT_GT(cam0.far_px, 50 * cam0.there_px);
}

TEST(DeterminedPart, IsNoneOfARigThatIsDetermined) {
  EXPECT_FALSE(determined_part(data_of(make_synthetic({.corner_sigma_px = 0.05})), {}));
}

TEST(DeterminedPart, IsNoneWhereTooLittleWasSeen) {
  EXPECT_FALSE(determined_part(data_of(make_synthetic({.placements = 2})), {}));
}

}  // namespace
}  // namespace crumple
