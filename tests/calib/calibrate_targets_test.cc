// Calibration from targets other than chessboards, observations made without the estimator's own model of them.
#include <cmath>
#include <iostream>

#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "tests/calib/drawn_target.h"

namespace crumple {
namespace {

// One camera, every target at `poses` placements of its own, seen exactly.
CalibrationData seen_exactly(const std::vector<BoardSpec>& boards, int poses) {
  CalibrationData data;
  data.sensors = {{"cam0", SensorKind::camera, drawing_lens().size(), drawing_lens().model()}};
  data.boards = boards;
  for (std::size_t b = 0; b < boards.size(); ++b) {
    const Board board = board_of(boards[b].target);
    for (int p = 0; p < poses; ++p) {
      const double turn = 2.4 * p;
      Pose pose = drawing_pose(boards[b].target, 430 + 30 * (p % 3),
                               Eigen::Vector3d(0.6 * std::cos(turn), 0.6 * std::sin(turn), 0.2 * (p % 2)));
      pose.translation += Eigen::Vector3d(25 * std::sin(1.7 * p), 15 * std::cos(1.1 * p), 0);
      CornerView view{0, data.placement_names.size(), {}, {}};
      for (int i = 0; i < board.point_count(); ++i) {
        view.corners.push_back(i);
        view.pixels.push_back(true_pixel(board, i, drawing_lens(), pose));
      }
      data.placement_names.push_back(boards[b].name + std::to_string(p));
      data.board_of.push_back(b);
      data.observations.corners.push_back(view);
    }
  }
  data.observations.placement_count = data.placement_names.size();
  return data;
}

double worst_lens_error(const Calibration& calibration) {
  const auto& found = calibration.bundle.state.rig.sensors[0].lens.parameters();
  const auto truth = drawing_lens().parameters();
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst = std::max(worst, std::abs(found[i] - truth[i]) / std::max(1.0, std::abs(truth[i])));
  }
  return worst;
}

TEST(CalibrateTargets, DotsWithoutTheBiasOfTheirCentres) {
  const Target dots{9, 7, 26, TargetKind::dots, 16};
  CalibrationData data = seen_exactly({{"board", dots, {}}}, 8);
  const auto modelled = calibrate(data, {.warp = WarpChoice::off});
  ASSERT_TRUE(modelled) << modelled.error().message;

  // The same observations taken for the images of the dots' centres.
  data.boards[0].target = {9, 7, 26};
  const auto naive = calibrate(data, {.warp = WarpChoice::off});
  ASSERT_TRUE(naive) << naive.error().message;
  EXPECT_GT(worst_lens_error(*naive), 1e-4);
  EXPECT_LT(worst_lens_error(*modelled), 0.02 * worst_lens_error(*naive));
  std::cout << "worst relative lens error: modelled " << worst_lens_error(*modelled) << ", naive "
            << worst_lens_error(*naive) << ", naive RMS " << naive->bundle.groups[0].rms_px << " px\n";
}

TEST(CalibrateTargets, SeveralBoardsTogether) {
  const BoardSpec large{"large", {9, 6, 25}, {}};
  const BoardSpec tags{"tags", {5, 4, 45, TargetKind::apriltag, 36, "APRILTAG_36h11"}, {}};
  const auto calibration = calibrate(seen_exactly({large, tags}, 4), {.warp = WarpChoice::on});
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_LT(worst_lens_error(*calibration), 1e-6);
  const auto& names = calibration->bundle.covariance.names();
  EXPECT_NE(std::find(names.begin(), names.end(), "tags.warp_y"), names.end());
  EXPECT_LT(calibration->bundle.state.boards[1].warp_mm.norm(), 1e-6);
}

}  // namespace
}  // namespace crumple
