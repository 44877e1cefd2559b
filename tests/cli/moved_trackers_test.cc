// A tracker that is moved during a campaign, from images: listed once for each place, it keeps its lens.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/rig_file.h"
#include "datasets/stations_file.h"
#include "datasets/truth.h"
#include "tests/cli/program.h"
#include "tests/cli/tracked_scan.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::Each;
using testing::IsSupersetOf;
using testing::Not;
using testing::StartsWith;

const std::string kMovedScene = CRUMPLE_SOURCE_DIR "/datasets/scenes/tracked_small.yaml";
const std::string kBefore = "cal_1,cal_2,cal_4,cal_6,shown_1,shown_2,shown_3,shown_4,shown_5,shown_6,door_1";
const std::string kAfter = "cal_3,cal_5,cal_7,door_2";

void simulate(const fs::path& scene, const std::string& stations, const fs::path& folder) {
  const ProgramRun run = run_program(
      fmt::format("simulate '{}' --stations={} --nodepth_maps --out='{}'", scene.string(), stations, folder.string()));
  ASSERT_EQ(run.exit_code, 0) << run.err;
}

std::string lines_from(const std::string& text, const std::string& first, const std::string& end) {
  const std::size_t begin = text.find(first);
  return text.substr(begin, text.find(end, begin) - begin);
}

// The images of both renderings as one capture: `tracker1` took those before it was moved, `tracker1b` those after.
void join(const fs::path& before, const fs::path& after) {
  for (const char* const station : {"cal_3", "cal_5", "cal_7", "door_2"}) {
    fs::rename(after / station / "tracker1", after / station / "tracker1b");
    fs::copy(after / station, before / station, fs::copy_options::recursive);
  }
  std::string text = content_of(before / "capture.yaml");
  const std::string tracker = lines_from(text, "  \"tracker1\":", "board:");
  std::string moved = tracker;
  moved.replace(moved.find("tracker1"), 8, "tracker1b");
  text.replace(text.find(tracker), tracker.size(),
               fmt::format("{}    stations: [{}]\n{}    stations: [{}]\n    lens_of: tracker1\n", tracker, kBefore,
                           moved, kAfter));
  const std::string stations = "\nstations:\n", others = content_of(after / "capture.yaml");
  write_content(before / "capture.yaml", text + others.substr(others.find(stations) + stations.size()));
}

// Standard uncertainties of where a sensor is, in tangent coordinates.
Vector6d sigmas_of(const Rig& rig, const std::string& sensor) {
  Vector6d sigmas = Vector6d::Constant(std::nan(""));
  for (std::size_t row = 0; row < rig.covariance.names.size(); ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    for (int axis = 0; axis < 3; ++axis) {
      const double sigma = std::sqrt(rig.covariance.matrix(i, i));
      if (rig.covariance.names[row] == fmt::format("{}.rotation_{}", sensor, "xyz"[axis])) sigmas[axis] = sigma;
      if (rig.covariance.names[row] == fmt::format("{}.translation_{}", sensor, "xyz"[axis])) sigmas[3 + axis] = sigma;
    }
  }
  return sigmas;
}

// Both trackers are where they were rendered, each after its move, within 4 sigmas.
void expect_at(const Rig& rig, const std::string& name, const Rig& truth) {
  const Sensor& found = rig.sensors[rig.find(name).value()];
  const Sensor& true_one = truth.sensors[truth.find("tracker1").value()];
  const Vector6d off = local_step(true_one.sensor_from_mount, found.sensor_from_mount);
  const Vector6d sigmas = sigmas_of(rig, name);
  for (int i = 0; i < 6; ++i) EXPECT_LE(std::abs(off[i]), 4 * sigmas[i]) << name << ", coordinate " << i;
}

// The probe's pose at a station, within 4 sigmas of the scene's: of its own pixels and of the rig.
void expect_posed(const StationsAndRig& posed, const std::string& station, const Scene& scene) {
  const auto found = std::find_if(posed.poses.stations.begin(), posed.poses.stations.end(),
                                  [&](const PosedStation& s) { return s.name == station; });
  const auto truth = std::find_if(scene.stations.begin(), scene.stations.end(),
                                  [&](const SceneStation& s) { return s.id == station; });
  ASSERT_TRUE(found != posed.poses.stations.end() && truth != scene.stations.end()) << station;
  const Eigen::Index row = 6 * (found - posed.poses.stations.begin());
  const auto d_rig = posed.poses.d_rig.middleRows<6>(row);
  const Matrix6d covariance =
      posed.poses.covariance.block<6, 6>(row, row) + d_rig * posed.rig.covariance.matrix * d_rig.transpose();
  const Vector6d off = local_step(truth->world_from_probe, found->world_from_probe);
  for (int i = 0; i < 6; ++i) {
    EXPECT_LE(std::abs(off[i]), 4 * std::sqrt(covariance(i, i))) << station << ", coordinate " << i;
  }
}

TEST(MovedTrackers, AreTiedByLedsAndKeepTheirLens) {
  const TemporaryFolder home;
  simulate(kMovedScene, kBefore, home / "before");
  const fs::path scene = home / "scene.yaml";
  fs::copy(kMovedScene, scene);
  replace_in(scene, "position_mm: [871.46, -85.51, 210.33]", "position_mm: [931.2, 44.7, 260.9]");
  replace_in(scene, "rotation_deg: [-0.504, -24.029, -8.678]", "rotation_deg: [2.1, -26.3, -6.2]");
  simulate(scene, kAfter, home / "after");
  if (HasFatalFailure()) return;
  join(home / "before", home / "after");
  add_scale_bar(home / "before/capture.yaml");
  const ProgramRun run = run_program(
      fmt::format("calibrate '{}' --truth='{}' --nooverlays --noreport --json --out='{}'",
                  (home / "before/capture.yaml").string(), (home / "before/truth").string(), (home / "rig").string()));
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["leds"]["reference"]["mount"], "world");
  const json& sensors = summary["sensors"];
  ASSERT_TRUE(sensors.contains("tracker1b"));
  EXPECT_GT(sensors["tracker1b"]["groups"]["leds"]["observations"], 10);
  EXPECT_EQ(sensors["tracker1b"]["parameters"], sensors["tracker1"]["parameters"]);

  // The truth beside the first rendering knows one place of that tracker.
  EXPECT_EQ(summary["truth"]["not_compared"], json::array({"tracker1b"}));
  std::vector<std::string> compared;
  for (const json& parameter : summary["truth"]["parameters"]) compared.push_back(parameter["name"]);
  EXPECT_THAT(compared, IsSupersetOf({"tracker1.fx", "tracker1.translation_x", "a.x", "reference.x"}));
  EXPECT_THAT(compared, Each(Not(StartsWith("tracker1b."))));

  const auto rig = read_rig(home / "rig");
  ASSERT_TRUE(rig) << rig.error().message;
  const Sensor& moved = rig->sensors[rig->find("tracker1b").value()];
  EXPECT_EQ(moved.lens_of, rig->find("tracker1"));
  for (const std::string& name : rig->covariance.names) EXPECT_NE(name, "tracker1b.fx");
  expect_at(*rig, "tracker1", read_true_rig(home / "before/truth").value());
  expect_at(*rig, "tracker1b", read_true_rig(home / "after/truth").value());

  // Before and after the move, each by the tracker where it stood then.
  const ProgramRun track = run_program(fmt::format("track '{}' --rig='{}' --stations=cal_2,cal_3 --out='{}'",
                                                   (home / "before/capture.yaml").string(), (home / "rig").string(),
                                                   (home / "poses").string()));
  ASSERT_EQ(track.exit_code, 0) << track.err;
  const auto posed = read_stations(home / "poses");
  ASSERT_TRUE(posed) << posed.error().message;
  const Scene truth = read_true_scene(home / "before/truth").value();
  expect_posed(*posed, "cal_2", truth);
  expect_posed(*posed, "cal_3", truth);

  // Scanned before and after it, one panel.
  const ProgramRun scan =
      run_program(fmt::format("reconstruct '{}' --rig='{}' --truth='{}' --stations=door_1,door_2 --json --out='{}'",
                              (home / "before/capture.yaml").string(), (home / "rig").string(),
                              (home / "before/truth").string(), (home / "cloud").string()));
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
  const json cloud = json::parse(scan.out);
  EXPECT_EQ(cloud["merged"]["weighted"]["stations"].size(), 2U);
  EXPECT_GT(cloud["merged"]["weighted"]["overlap_share"].get<double>(), 0.5);
  expect_as_good_as_stated(cloud);
}

}  // namespace
}  // namespace crumple
