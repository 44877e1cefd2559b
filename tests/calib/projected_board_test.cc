// A rendered scene: a small printed board in the middle of a wide plate, a projected one over all of it.
#include "calib/projected_board.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "calib/detect_board.h"
#include "datasets/render/render.h"
#include "datasets/render/scene.h"
#include "datasets/scene_file.h"

namespace crumple {
namespace {

using testing::HasSubstr;

Scene projected_board_scene() {
  Scene scene = read_scene(CRUMPLE_SOURCE_DIR "/datasets/scenes/projected_board.yaml").value();
  scene.samples = 4;
  return scene;
}

ProjectedBoardImages rendered(const Scene& scene, const Renderer& renderer, std::size_t station) {
  ProjectedBoardImages images;
  std::mutex mutex;
  const auto done = renderer.render_station(station, [&](const RenderedFrame& frame) -> Expected<void> {
    const std::lock_guard lock(mutex);
    switch (scene.frames[frame.frame].kind) {
      case FrameContent::Kind::white:
        images.white = frame.image.clone();
        break;
      case FrameContent::Kind::black:
        images.black = frame.image.clone();
        break;
      default:
        images.chessboard = frame.image.clone();
    }
    return {};
  });
  EXPECT_TRUE(done) << done.error().message;
  return images;
}

CornerView printed_corners(const cv::Mat& white, const Target& board, std::size_t placement) {
  const DetectedBoard found = detect_grid(white, board.columns, board.rows).value();
  return {0, placement, found.corners, found.pixels};
}

double rms_from_truth(const ProjectedCorners& found, const FeatureView& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < found.camera_pixels.size(); ++i) {
    const auto same =
        std::find(truth.projector_pixels.begin(), truth.projector_pixels.end(), found.projector_pixels[i]);
    if (same == truth.projector_pixels.end()) return INFINITY;
    const auto index = static_cast<std::size_t>(same - truth.projector_pixels.begin());
    sum += (found.camera_pixels[i] - truth.camera_pixels[index]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(found.camera_pixels.size()));
}

TEST(ProjectedBoard, CornersBesideThePrintAreFoundWhereTheyAre) {
  const Scene scene = projected_board_scene();
  const Renderer renderer(scene, 2);
  const std::vector<FeatureView> truth = ideal_observations(scene, 100).features;
  const std::size_t station = 6;
  const ProjectedBoardImages images = rendered(scene, renderer, station);
  const Target& board = scene.board->target();
  const CornerView printed = printed_corners(images.white, board, station);
  const auto found = detect_projected_board(images, *scene.projected_chessboard, board, printed);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->camera_pixels.size(), 45U);
  EXPECT_LT(found->camera_pixels.size(), 88U);  // those on the print's edges and dark squares are left out
  EXPECT_LT(rms_from_truth(*found, truth[station]), 0.08);

  // Without the projected board there is none to find, and the printed one is not taken for it.
  ProjectedBoardImages unlit = images;
  unlit.chessboard = images.white;
  const ProjectedChessboard like_the_print{board.columns, board.rows, {100, 100}, 40};
  const auto none = detect_projected_board(unlit, like_the_print, board, printed);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("the projected chessboard"));
  unlit.white.release();
  EXPECT_FALSE(detect_projected_board(unlit, like_the_print, board, printed));
}

TEST(ProjectedBoard, CalibratesTheProjectorWithoutStripes) {
  const Scene scene = projected_board_scene();
  const Renderer renderer(scene, 2);
  const Target& board = scene.board->target();
  CalibrationData data;
  const Rig truth = true_rig(scene);
  for (const Sensor& sensor : truth.sensors) data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size()});
  data.boards = {{"board", board, {}}};
  for (std::size_t p = 0; p < scene.stations.size(); ++p) {
    const ProjectedBoardImages images = rendered(scene, renderer, p);
    const CornerView printed = printed_corners(images.white, board, p);
    const auto found = detect_projected_board(images, *scene.projected_chessboard, board, printed);
    ASSERT_TRUE(found) << scene.stations[p].id << ": " << found.error().message;
    data.placement_names.push_back(scene.stations[p].id);
    data.board_of.push_back(0);
    data.observations.corners.push_back(printed);
    data.observations.features.push_back({1, 0, p, found->projector_pixels, found->camera_pixels});
    data.pairs.push_back({0, 1, p, found->camera_pixels, found->projector_pixels});
  }
  data.observations.placement_count = data.placement_names.size();
  const auto calibration = calibrate(data, {});
  ASSERT_TRUE(calibration) << calibration.error().message;

  const CalibrationState& state = calibration->bundle.state;
  const std::vector<double>& estimate = state.rig.sensors[1].lens.parameters();
  const std::vector<double>& expected = truth.sensors[1].lens.parameters();
  const Eigen::MatrixXd covariance = calibration->bundle.covariance.of({{BlockId::Kind::lens, 1}}, state);
  ASSERT_EQ(static_cast<Eigen::Index>(estimate.size()), covariance.rows());
  EXPECT_NEAR(estimate[0], expected[0], 0.01 * expected[0]);
  EXPECT_NEAR(estimate[1], expected[1], 0.01 * expected[1]);
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_LT(std::abs(estimate[i] - expected[i]), 4 * std::sqrt(covariance(row, row))) << "parameter " << i;
  }
  const Eigen::Vector3d shift =
      state.rig.sensors[1].sensor_from_mount.translation - truth.sensors[1].sensor_from_mount.translation;
  EXPECT_LT(shift.norm(), 2);
}

}  // namespace
}  // namespace crumple
