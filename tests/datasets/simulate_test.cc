#include "datasets/simulate.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "calib/detect_target.h"
#include "datasets/capture.h"
#include "datasets/check_capture.h"
#include "datasets/render/led_spots.h"
#include "datasets/render/render.h"
#include "datasets/rig_file.h"
#include "tests/datasets/tracked_scene.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

class Simulate : public testing::Test {
 protected:
  // One board and the panel, columns only.
  static Scene short_scene() {
    Scene scene = scene_from_file("small.yaml");
    scene.samples = 4;
    scene.stations.erase(scene.stations.begin() + 1, scene.stations.begin() + 4);
    scene.orientations.resize(1);
    scene.frames.resize(20);
    return scene;
  }

  TemporaryFolder root_;
};

TEST_F(Simulate, writes_a_capture_that_reads_back) {
  const Scene scene = short_scene();
  std::size_t images_done = 0;
  const auto folder = simulate(scene, "the scene's text", root_ / "capture",
                               {2, false, true, [&](std::size_t done, std::size_t) { images_done = done; }});
  ASSERT_TRUE(folder) << folder.error().message;
  EXPECT_EQ(images_done, 40U);

  const auto capture = read_capture(*folder / "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->frames.size(), scene.frames.size());
  ASSERT_EQ(capture->stations.size(), 2U);
  EXPECT_EQ(capture->stations[0].boards.size(), 1U);
  EXPECT_TRUE(capture->stations[1].boards.empty());
  const auto images = read_stripe_images(*capture, "cam0", "panel_1");
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->stacks.size(), 1U);

  const TrueGeometry truth = Renderer(scene, 1).true_geometry(1, 0);
  const cv::Mat1f depth = cv::imread((*folder / "truth/panel_1/cam0_depth.tiff").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.size(), truth.depth_mm.size());
  EXPECT_NEAR(depth(120, 160), truth.depth_mm(120, 160), 1e-4);
  EXPECT_TRUE(std::isnan(depth(0, 0)));

  const auto rig = read_rig(*folder / "truth/rig");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->sensors[1].lens.parameters(), scene.projector->sensor.lens.parameters());
}

TEST_F(Simulate, refuses_an_existing_folder) {
  fs::create_directories(root_ / "capture");
  std::ofstream(root_ / "capture/precious.txt") << "mine";
  const auto folder = simulate(short_scene(), "", root_ / "capture", {});
  ASSERT_FALSE(folder);
  EXPECT_NE(folder.error().message.find("capture"), std::string::npos);
  EXPECT_TRUE(fs::exists(root_ / "capture/precious.txt"));
}

TEST_F(Simulate, leaves_nothing_behind_where_it_fails) {
  Scene scene = short_scene();
  scene.stations[1].id = "panel\n1";
  scene.cameras[0].sensor.name = std::string(300, 'n');  // no file system takes that
  ASSERT_FALSE(simulate(scene, "", root_ / "capture", {}));
  EXPECT_TRUE(fs::is_empty(root_.path()));
}

TEST_F(Simulate, writes_what_trackers_see) {
  Scene scene = tracked_scene();
  scene.stations.erase(scene.stations.begin() + 1, scene.stations.begin() + 2);
  scene.frames = {{FrameContent::Kind::white, 0, 0, false}};
  scene.orientations.clear();
  scene.tracking.missing_frames = 0.2;
  const auto folder = simulate(scene, "", root_ / "capture", {2, false, false, {}});
  ASSERT_TRUE(folder) << folder.error().message;
  EXPECT_TRUE(fs::exists(*folder / "one/tracker1/000.png"));
  EXPECT_FALSE(fs::exists(*folder / "wand/cam0"));
  EXPECT_FALSE(fs::exists(*folder / "door/tracker0"));
  for (std::size_t frame = 0; frame < 9; ++frame) {
    const std::string name = fmt::format("one/tracker0/{:03}.png", frame);
    EXPECT_EQ(fs::exists(*folder / name), !is_missing(scene, 0, 0, frame)) << name;
  }
  const auto capture = read_capture(*folder);
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_FALSE(has_error(check_capture(*capture)));
  const auto rig = read_rig(*folder / "truth/rig");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->sensors[3].mount, Mount::world);
  EXPECT_EQ(rig->leds[0].position_mm, scene.tracking.leds[0].led.position_mm);
  const std::string truth = content_of(*folder / "truth/stations.yaml");
  EXPECT_THAT(truth, testing::StartsWith("schema: crumple-true-stations/2"));
  EXPECT_THAT(truth, testing::HasSubstr("world_from_board"));
}

// The board in a tracker's ambient image, found by the detector that calibration uses.
TEST_F(Simulate, trackers_see_the_board_where_the_model_says) {
  Scene scene = tracked_scene();
  scene.samples = 16;
  scene.stations[0].probe_from_surface = Pose{};
  scene.stations[0].world_from_probe = Pose{rotation_from_vector({0.2, -0.3, 0.05}), {-90, -70, 560}};
  const Observations ideal = ideal_observations(scene, 40);
  const auto expected = std::find_if(ideal.corners.begin(), ideal.corners.end(),
                                     [](const CornerView& view) { return view.sensor == 2 && !view.station; });
  ASSERT_NE(expected, ideal.corners.end());
  ASSERT_EQ(expected->corners.size(), 54U);
  cv::Mat image;
  ASSERT_TRUE(Renderer(scene, 2).render_trackers(0, [&](const RenderedFrame& frame) -> Expected<void> {
    if (frame.camera == 0 && frame.frame == 0) image = frame.image;
    return {};
  }));
  const auto found = detect_target(image, scene.board->target());
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->corners, expected->corners);
  double squares = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < found->pixels.size(); ++i) {
    const Eigen::Vector2d error = found->pixels[i] - expected->pixels[i];
    squares += error.squaredNorm();
    sum += error;
  }
  // The noise of corners of squares 13 px wide; their mean lies where it should.
  const auto count = static_cast<double>(found->pixels.size());
  EXPECT_LT(std::sqrt(squares / (2 * count)), 0.08);
  EXPECT_LT((sum / count).norm(), 0.03);
}

}  // namespace
}  // namespace crumple
