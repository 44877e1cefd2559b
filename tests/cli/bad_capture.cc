#include "tests/cli/bad_capture.h"

#include <map>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "datasets/scene_file.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

Scene scene_of(SmallCapture which) {
  Scene scene = read_scene(CRUMPLE_SOURCE_DIR "/datasets/scenes/small.yaml").value();
  scene.samples = 1;
  scene.stations.pop_back();  // the panel
  scene.orientations = {{.angle_rad = 0, .stripe_width_px = 4, .bits = 7},
                        {.angle_rad = std::numbers::pi / 2, .stripe_width_px = 4, .bits = 6}};
  scene.frames = {{FrameContent::Kind::white}, {FrameContent::Kind::black}};
  for (const FrameContent& frame : stripe_frames(scene.orientations)) scene.frames.push_back(frame);
  scene.lighting.ambient = 0.3;
  if (which == SmallCapture::turned_away) {
    Pose turn;
    turn.rotation = rotation_from_vector({0, 1.5, 0});
    scene.projector->sensor.sensor_from_mount = turn * scene.projector->sensor.sensor_from_mount;
  }
  if (which == SmallCapture::parallel) {
    const Pose first = scene.stations.front().probe_from_surface;
    for (std::size_t i = 0; i < scene.stations.size(); ++i) {
      const double step = static_cast<double>(i);
      scene.stations[i].probe_from_surface = first;
      scene.stations[i].probe_from_surface.translation += Eigen::Vector3d(6 * step, -4 * step, 15 * step);
    }
  }
  return scene;
}

class Originals : public testing::Environment {
 public:
  void TearDown() override { home_.reset(); }

  fs::path folder(SmallCapture which) {
    if (!home_) home_ = std::make_unique<TemporaryFolder>();
    const auto [made, is_new] = folders_.try_emplace(which);
    if (is_new) {
      const fs::path folder = *home_ / std::to_string(static_cast<int>(which));
      made->second = simulate(scene_of(which), "made by a test", folder, {2, false, false, {}}).value();
    }
    return made->second;
  }

 private:
  std::unique_ptr<TemporaryFolder> home_;
  std::map<SmallCapture, fs::path> folders_;
};

Originals* const originals = static_cast<Originals*>(testing::AddGlobalTestEnvironment(new Originals));

}  // namespace

void DamagedCapture::make(SmallCapture which) {
  fs::copy(originals->folder(which), home_ / "capture", fs::copy_options::recursive);
  fs::create_directory(home_ / "results");
}

fs::path DamagedCapture::image(int station, int frame) const {
  return home_ / fmt::format("capture/board_{}/cam0/{:03}.png", station, frame);
}

void DamagedCapture::expect_refused(const std::string& verb, const std::vector<std::string>& said,
                                    const std::string& before) {
  const std::string out = verb == "check" ? "" : fmt::format(" --out='{}'", (home_ / "results/rig").string());
  const ProgramRun run = run_program(fmt::format("{} '{}'{}", verb, description().string(), out), before);
  EXPECT_EQ(run.exit_code, 3) << run.out << run.err;
  const std::string& text = verb == "check" ? run.out : run.err;
  for (const std::string& words : said) EXPECT_THAT(text, testing::HasSubstr(words)) << verb;
  EXPECT_TRUE(fs::is_empty(home_ / "results")) << "something half-written is left";
}

}  // namespace crumple
