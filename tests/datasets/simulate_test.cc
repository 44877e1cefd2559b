#include "datasets/simulate.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/capture.h"
#include "datasets/render/render.h"
#include "datasets/rig_file.h"
#include "tests/datasets/render_scenes.h"
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

}  // namespace
}  // namespace crumple
