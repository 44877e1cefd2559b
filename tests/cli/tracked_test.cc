// A tracked probe from images to poses: rendered, calibrated together with its trackers, tracked.
#include <map>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/capture.h"
#include "datasets/pose_csv.h"
#include "datasets/rig_file.h"
#include "tests/cli/tracked_system.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(TrackedSystemVerbs, CalibrateRefinesEverythingTogether) {
  const TrackedSystem& system = TrackedSystem::get();
  ASSERT_EQ(system.rendered().exit_code, 0) << system.rendered().err;
  // Its LEDs scatter by 0.003 px: what is off by a hundredth of a pixel is no reason to doubt it.
  ASSERT_EQ(system.calibrated().exit_code, 0) << system.calibrated().err << system.calibrated().out;
  const json summary = json::parse(system.calibrated().out);
  EXPECT_EQ(summary["leds"].size(), 5U);
  EXPECT_EQ(summary["stations"], 9);
  EXPECT_TRUE(summary["sensors"]["tracker1"]["groups"].contains("leds"));
  const json& truth = summary["truth"];
  EXPECT_GE(truth["share_within_3_sigma"], 0.95);
  const json& hand_eye = truth["hand_eye"];
  EXPECT_LT(hand_eye["joint"]["mm"], 1.5);
  EXPECT_LT(hand_eye["joint"]["mm"].get<double>(), hand_eye["closed_forms"]["mm"].get<double>());
  const std::string rig = content_of(system.rig() + "/rig.yaml");
  EXPECT_THAT(rig, HasSubstr(summary["verdict"] == "ok" ? "crumple-rig/2" : "crumple-rig/4"));
  EXPECT_THAT(rig, HasSubstr("sensor_from_world"));
  EXPECT_THAT(content_of(system.rig() + "/placements.yaml"), HasSubstr("world_from_probe"));
  EXPECT_THAT(content_of(system.rig() + "/residuals.csv"), HasSubstr("wand_1,tracker0,tracker0,leds,0,"));
}

TEST(TrackedSystemVerbs, CalibrateChoosesALensForEachKindOfSensor) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder out;
  const ProgramRun run =
      run_program("calibrate '" + system.capture() +
                  "/capture.yaml' --lens=auto --nooverlays --noreport --json --out='" + (out / "rig").string() + "'");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  const json summary = json::parse(run.out);
  std::map<std::string, std::string> model_of;
  for (const json& choice : summary["lens_choice"]) model_of[choice["kind"]] = choice["model"];
  ASSERT_EQ(model_of.size(), 2U);
  const Rig rig = read_rig(out / "rig").value();
  for (const Sensor& sensor : rig.sensors) {
    EXPECT_EQ(sensor.lens.model(), model_of[sensor.mount == Mount::world ? "tracker" : "camera"]) << sensor.name;
  }
}

TEST(TrackedSystemVerbs, TrackPosesEveryStationThatShowsLeds) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  const ProgramRun run =
      run_program("track '" + system.capture() + "/capture.yaml' --rig='" + system.rig() +
                  "' --stations=cal_01,cal_05,wand_1,shown_01 --json --out='" + (home / "poses").string() + "'");
  EXPECT_EQ(run.exit_code, 5) << run.err;  // the probe was put aside at shown_01
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["stations"].size(), 3U);
  ASSERT_EQ(summary["failed"].size(), 1U);
  EXPECT_EQ(summary["failed"][0]["id"], "shown_01");
  const json& wand = summary["stations"]["wand_1"];
  // tests/data/scenes/tracked.yaml: [-275.61, 1.49, 1784.39] in the frame of the first tracker.
  EXPECT_NEAR(wand["translation_mm"][0].get<double>(), -275.61, 6);
  EXPECT_NEAR(wand["translation_mm"][1].get<double>(), 1.49, 6);
  EXPECT_NEAR(wand["translation_mm"][2].get<double>(), 1784.39, 6);
  EXPECT_THAT(content_of(home / "poses/poses.csv"), HasSubstr("\nwand_1,"));
  EXPECT_THAT(content_of(home / "poses/poses.csv"),
              testing::StartsWith(fmt::format("{},c00,c01,", kStationPoseColumns)));
}

// Words of 16 steps in 16 frames: nothing is there to compare, and that is said once for all stations.
TEST(TrackedSystemVerbs, TrackSaysThatStillnessWasNotTested) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  const ProgramRun run = run_program("track '" + system.capture() + "/capture.yaml' --rig='" + system.rig() +
                                     "' --stations=cal_01,cal_05 --out='" + (home / "poses").string() + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("stillness was not tested at cal_01, cal_05: the LEDs' words were read once there"));
  const json stations = json::parse(content_of(home / "poses/summary.json"))["stations"];
  for (const char* id : {"cal_01", "cal_05"}) {
    ASSERT_TRUE(stations[id].contains("stillness")) << id;
    EXPECT_TRUE(stations[id]["stillness"].is_null()) << id;
  }
}

TEST(TrackedSystemVerbs, AnotherProbesRigIsRefused) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  std::filesystem::copy(system.rig(), home / "rig", std::filesystem::copy_options::recursive);
  std::string rig = content_of(home / "rig/rig.yaml");
  for (std::size_t at = 0; (at = rig.find("name: \"c\"", at)) != std::string::npos;) rig.replace(at, 9, "name: \"z\"");
  std::ofstream(home / "rig/rig.yaml") << rig;
  const ProgramRun run = run_program("track '" + system.capture() + "/capture.yaml' --rig='" + (home / "rig").string() +
                                     "' --out='" + (home / "poses").string() + "'");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("no LED c"));
}

// The rig's own capture is held against it, as it is and after a tracker's nudge.
TEST(TrackedSystemVerbs, CheckNamesTheTrackerThatMoved) {
  const TrackedSystem& system = TrackedSystem::get();
  const std::string check = "check '" +
                            system.with_stations("interim.yaml",
                                                 "  - {id: cal_01, placement: bench_a}\n"
                                                 "  - {id: cal_06, placement: bench_b}\n"
                                                 "  - {id: cal_09, placement: bench_c}\n"
                                                 "  - {id: wand_1, board: false, scan: false}\n") +
                            "' --json --rig='";
  const ProgramRun same = run_program(check + system.rig() + "'");
  EXPECT_EQ(same.exit_code, 0) << same.err << same.out;
  EXPECT_TRUE(json::parse(same.out)["rig"]["valid"]);
  Rig nudged = read_rig(system.rig()).value();
  Sensor& tracker = nudged.sensors[*nudged.find("tracker1")];
  tracker.sensor_from_mount.translation.x() += 8;
  TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), nudged));
  const ProgramRun moved = run_program(check + home.path().string() + "'");
  EXPECT_EQ(moved.exit_code, 4) << moved.err << moved.out;
  const json changed = json::parse(moved.out)["rig"]["changed"];
  ASSERT_FALSE(changed.empty());
  EXPECT_THAT(changed[0].dump(), HasSubstr("the place of tracker1"));
}

// So small that every station's pose looks sound by itself; all together show it.
TEST(TrackedSystemVerbs, TrackNamesTheTrackerThatMoved) {
  const TrackedSystem& system = TrackedSystem::get();
  const std::string track = "track '" + system.capture() +
                            "/capture.yaml' --json --stations=cal_02,cal_03,cal_05,cal_06,cal_07,wand_1 --rig='";
  const TemporaryFolder home, nudged_home;
  const ProgramRun same = run_program(track + system.rig() + "' --out='" + (home / "same").string() + "'");
  ASSERT_EQ(same.exit_code, 0) << same.err << same.out;
  EXPECT_TRUE(json::parse(same.out)["rig_check"]["valid"]);
  Rig nudged = read_rig(system.rig()).value();
  nudged.sensors[*nudged.find("tracker1")].sensor_from_mount.translation.x() += 0.5;
  ASSERT_TRUE(write_rig(nudged_home.path(), nudged));
  const ProgramRun moved =
      run_program(track + nudged_home.path().string() + "' --out='" + (home / "moved").string() + "'");
  EXPECT_EQ(moved.exit_code, 4) << moved.err << moved.out;
  const json document = json::parse(moved.out);
  EXPECT_TRUE(document["failed"].empty());
  EXPECT_THAT(document["rig_check"]["changed"].dump(), HasSubstr("the place of tracker1"));
  EXPECT_TRUE(std::filesystem::exists(home / "moved/poses.csv"));
}

// Where gnuplot is not to be found the rig is written all the same, and no half of a report.
TEST(TrackedSystemVerbs, CalibrateGoesOnFromARig) {
  const TrackedSystem& system = TrackedSystem::get();
  TemporaryFolder home;
  const std::string few = system.with_stations("few.yaml",
                                               "  - {id: cal_02, placement: bench_a}\n"
                                               "  - {id: cal_03, placement: bench_a}\n"
                                               "  - {id: cal_07, placement: bench_b}\n");
  const ProgramRun run = run_program("calibrate '" + few + "' --nooverlays --json --start='" + system.rig() +
                                         "' --correct=tracker1,leds --out='" + (home / "rig").string() + "'",
                                     "PATH=/nowhere");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  EXPECT_THAT(run.err, HasSubstr("no report.html: gnuplot cannot be run"));
  EXPECT_FALSE(std::filesystem::exists(home / "rig/report.html"));
  const Rig before = read_rig(system.rig()).value(), after = read_rig(home / "rig").value();
  EXPECT_EQ(before.sensors[0].lens.parameters(), after.sensors[0].lens.parameters());
  EXPECT_NE(before.sensors[*before.find("tracker1")].lens.parameters(),
            after.sensors[*after.find("tracker1")].lens.parameters());

  const ProgramRun diff = run_program("diff '" + system.rig() + "' '" + (home / "rig").string() + "'");
  EXPECT_THAT(diff.exit_code, testing::AnyOf(0, 4)) << diff.err;
  EXPECT_THAT(diff.out, HasSubstr("not independent: " + (home / "rig").string() + " went on from " + system.rig()));
}

TEST(TrackedSystemVerbs, ATrackerWithAnothersImagesIsNamed) {
  const TrackedSystem& system = TrackedSystem::get();
  TemporaryFolder home;
  const std::filesystem::path mixed = home / "mixed";
  std::filesystem::copy(system.capture(), mixed, std::filesystem::copy_options::recursive);
  system.with_stations("one.yaml", "  - {id: wand_1, board: false, scan: false}\n");
  std::filesystem::copy_file(system.capture() + "/one.yaml", mixed / "one.yaml",
                             std::filesystem::copy_options::overwrite_existing);
  const Capture capture = read_capture(mixed / "one.yaml").value();
  for (std::size_t frame = 0; frame < capture.frames_of("tracker0").size(); ++frame) {
    std::filesystem::copy_file(capture.image_file("tracker0", "wand_1", frame),
                               capture.image_file("tracker1", "wand_1", frame),
                               std::filesystem::copy_options::overwrite_existing);
  }
  const ProgramRun run = run_program("calibrate '" + (mixed / "one.yaml").string() + "' --nooverlays --out='" +
                                     (home / "rig").string() + "'");
  EXPECT_EQ(run.exit_code, 3) << run.out;
  EXPECT_THAT(run.err, HasSubstr("station wand_1: tracker0 and tracker1 have the same images"));
  EXPECT_FALSE(std::filesystem::exists(home / "rig"));
}

// The trackers calibrated, and a probe whose LEDs they have never seen. What was said against the trackers is said of
// what they find.
TEST(TrackedSystemVerbs, TrackFindsTheLedsOfAnUnknownProbe) {
  const TrackedSystem& system = TrackedSystem::get();
  Rig trackers = read_rig(system.rig()).value();
  const Rig known = trackers;
  trackers.leds.clear();
  trackers.rejected = true;
  trackers.doubts = {"tracker0: the focal length is known to 12.0 % only"};
  TemporaryFolder home;
  std::filesystem::create_directory(home / "trackers");
  ASSERT_TRUE(write_rig(home / "trackers", trackers));
  std::string stations;
  for (const char* id : {"cal_01", "cal_02", "cal_03", "cal_05", "cal_06", "cal_07", "cal_09", "cal_10", "wand_1"}) {
    stations += fmt::format("  - {{id: {}, board: false, scan: false}}\n", id);
  }
  const ProgramRun run = run_program("track '" + system.with_stations("leds.yaml", stations) + "' --rig='" +
                                     (home / "trackers").string() + "' --out='" + (home / "poses").string() + "'");
  ASSERT_EQ(run.exit_code, 4) << run.err << run.out;
  EXPECT_THAT(run.out, testing::AllOf(HasSubstr("knows no LED of this probe"),
                                      HasSubstr("the rig was rejected when calibrated: " + trackers.doubts.front())));
  const Rig found = read_rig(home / "poses/rig").value();
  EXPECT_TRUE(found.rejected);
  EXPECT_THAT(found.doubts, testing::Contains(trackers.doubts.front()));
  ASSERT_EQ(found.leds.size(), known.leds.size());
  for (std::size_t a = 0; a < known.leds.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      EXPECT_NEAR((found.leds[a].position_mm - found.leds[b].position_mm).norm(),
                  (known.leds[a].position_mm - known.leds[b].position_mm).norm(), 0.7);
    }
  }
}

}  // namespace
}  // namespace crumple
