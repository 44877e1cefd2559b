// Stations at which one tracker sees three LEDs: two poses explain the pixels, and --near says which.
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/rig_file.h"
#include "datasets/stations_file.h"
#include "tests/cli/tracked_system.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// The tracked capture of three LEDs, with five of its stations, three of them before one tracker alone. The probe
// turned by 31 deg from cal_01 to cal_05, from cal_06 by 29 to cal_07 and by 32 to cal_09; the poses that explain the
// pixels are 42 deg apart at cal_05, 166 at cal_07 and 85 at cal_09.
std::string three_leds() {
  const std::filesystem::path file =
      TrackedSystem::get().with_stations("three_leds.yaml",
                                         "  - {id: cal_01, placement: bench_a}\n"
                                         "  - {id: cal_05, placement: bench_a}\n"
                                         "  - {id: cal_06, placement: bench_b}\n"
                                         "  - {id: cal_07, placement: bench_b}\n"
                                         "  - {id: cal_09, placement: bench_c}\n"
                                         "exclude:\n"
                                         "  - {station: cal_05, sensor: tracker1, reason: its view was blocked}\n"
                                         "  - {station: cal_07, sensor: tracker1, reason: its view was blocked}\n"
                                         "  - {station: cal_09, sensor: tracker1, reason: its view was blocked}\n");
  for (const char* led : {"  \"d\":", "  \"e\":"}) {
    std::string text = content_of(file);
    const std::size_t begin = text.find(led);
    text.erase(begin, text.find('\n', begin) + 1 - begin);
    write_content(file, text);
  }
  return file.string();
}

ProgramRun track(const std::string& capture, const std::filesystem::path& out, const std::string& flags) {
  return run_program("track '" + capture + "' --rig='" + TrackedSystem::get().rig() + "' --json --out='" +
                     out.string() + "' " + flags);
}

Pose pose_of(const json& station) {
  const auto& q = station["quaternion_wxyz"];
  const auto& t = station["translation_mm"];
  return {{q[0].get<double>(), q[1].get<double>(), q[2].get<double>(), q[3].get<double>()},
          {t[0].get<double>(), t[1].get<double>(), t[2].get<double>()}};
}

// The other pose of a station is turned by 42 deg or more.
void expect_posed_like(const json& station, const Pose& well_posed) {
  const Pose found = pose_of(station);
  EXPECT_LT(found.rotation.angularDistance(well_posed.rotation), 0.02);
  EXPECT_LT((found.translation - well_posed.translation).norm(), 15);
}

class WellPosed {
 public:
  static const WellPosed& get() {
    static const WellPosed all;
    return all;
  }
  std::filesystem::path folder() const { return home_ / "poses"; }
  Pose at(const std::string& station) const { return pose_of(json::parse(run_.out)["stations"][station]); }

 private:
  WellPosed()
      : run_(track(TrackedSystem::get().capture() + "/capture.yaml", home_ / "poses",
                   "--stations=cal_01,cal_05,cal_06,cal_07,cal_09")) {}
  TemporaryFolder home_;
  ProgramRun run_;
};

TEST(TrackedSystemVerbs, ThreeLedsBeforeOneTrackerAreRefusedUnlessSomethingDecides) {
  const TemporaryFolder home;
  const ProgramRun run = track(three_leds(), home / "poses", "");
  ASSERT_EQ(run.exit_code, 5) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_TRUE(summary["stations"].contains("cal_01") && summary["stations"].contains("cal_06")) << run.out;
  ASSERT_EQ(summary["failed"].size(), 3U);
  for (const json& failed : summary["failed"]) {
    EXPECT_THAT(failed["reason"].get<std::string>(), HasSubstr("2 poses explain the LEDs' pixels alike"));
    EXPECT_THAT(failed["reason"].get<std::string>(), HasSubstr("--near"));
  }
}

TEST(TrackedSystemVerbs, TheStationBeforeDecidesWhereItIsNearEnough) {
  const TemporaryFolder home;
  const ProgramRun run = track(three_leds(), home / "poses", "--near=previous");
  ASSERT_EQ(run.exit_code, 5) << run.err;
  const json summary = json::parse(run.out);
  ASSERT_TRUE(summary["stations"].contains("cal_07")) << run.out;
  const json& posed = summary["stations"]["cal_07"];
  expect_posed_like(posed, WellPosed::get().at("cal_07"));
  EXPECT_EQ(posed["redundancy"], 0);
  EXPECT_EQ(posed["choice"]["poses"], 2);
  EXPECT_EQ(posed["choice"]["near"], "station cal_06");
  EXPECT_NEAR(posed["choice"]["turn_deg"], 29, 2);
  EXPECT_FALSE(summary["stations"]["cal_06"].contains("choice"));
  ASSERT_EQ(summary["failed"].size(), 2U);
  EXPECT_EQ(summary["failed"][0]["id"], "cal_05");
  EXPECT_THAT(summary["failed"][0]["reason"].get<std::string>(),
              HasSubstr("station cal_01 does not decide between them"));
  // cal_07 before it was taken for being near cal_06, and so tells nothing further.
  EXPECT_EQ(summary["failed"][1]["id"], "cal_09");
  EXPECT_THAT(summary["failed"][1]["reason"].get<std::string>(),
              HasSubstr("station cal_06 does not decide between them"));
}

// A run over all LEDs left stations.yaml; its folder is named, then a file of one's own.
TEST(TrackedSystemVerbs, AnEarlierRunsStationsDecide) {
  const TemporaryFolder home;
  const std::filesystem::path earlier = WellPosed::get().folder();
  const ProgramRun run = track(three_leds(), home / "poses", "--near='" + earlier.string() + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const json summary = json::parse(run.out);
  for (const char* id : {"cal_05", "cal_07", "cal_09"}) {
    const json& posed = summary["stations"][id];
    expect_posed_like(posed, WellPosed::get().at(id));
    EXPECT_EQ(posed["choice"]["near"], id + (" of " + (earlier / "stations.yaml").string()));
    EXPECT_GT(posed["sigma_mm"], 0);
  }
  EXPECT_THAT(content_of(home / "poses/ro-crate-metadata.json"),
              HasSubstr("file://" + (earlier / "stations.yaml").string()));

  // The entry of another station under this one's id: only its turn counts.
  write_content(home / "mine.yaml", content_of(earlier / "stations.yaml"));
  replace_in(home / "mine.yaml", "id: \"cal_07\"", "id: \"old\"");
  replace_in(home / "mine.yaml", "id: \"cal_06\"", "id: \"cal_07\"");
  const ProgramRun again =
      track(three_leds(), home / "again", "--stations=cal_07 --near='" + (home / "mine.yaml").string() + "'");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const json posed = json::parse(again.out)["stations"]["cal_07"];
  expect_posed_like(posed, WellPosed::get().at("cal_07"));
  EXPECT_THAT(posed["choice"]["near"].get<std::string>(),
              HasSubstr("mine.yaml (not known to be in this frame: no run"));
}

// The earlier run's rig has its second tracker turned by 3 deg from where it is now.
TEST(TrackedSystemVerbs, AnEarlierRunsStationsAreRefusedAfterATrackerWasMoved) {
  const TemporaryFolder home;
  std::filesystem::copy(WellPosed::get().folder(), home / "earlier", std::filesystem::copy_options::recursive);
  Rig rig = read_rig(home / "earlier/rig").value();
  Pose& mount = rig.sensors[*rig.find("tracker1")].sensor_from_mount;
  mount.rotation = rotation_from_vector({0, 0.052, 0}) * mount.rotation;
  ASSERT_TRUE(write_rig(home / "earlier/rig", rig));
  for (const std::string verb : {"track", "reconstruct"}) {
    const ProgramRun run =
        run_program(verb + " '" + three_leds() + "' --rig='" + TrackedSystem::get().rig() + "' --out='" +
                    (home / verb).string() + "' --near='" + (home / "earlier").string() + "'");
    EXPECT_EQ(run.exit_code, 3) << verb << run.out;
    EXPECT_THAT(run.err, HasSubstr("tracker1 stands 3.0 deg")) << verb;
    EXPECT_FALSE(std::filesystem::exists(home / verb));
  }
}

TEST(TrackedSystemVerbs, WhatIsStatedMustBeRead) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  const std::string capture = system.capture() + "/capture.yaml", truth = system.capture() + "/truth/stations.yaml";
  for (const std::string verb : {"track", "reconstruct"}) {
    const std::string command =
        verb + " '" + capture + "' --rig='" + system.rig() + "' --out='" + (home / "out").string() + "' --near=";
    const ProgramRun missing = run_program(command + "'" + (home / "none.yaml").string() + "'");
    EXPECT_EQ(missing.exit_code, 3) << missing.out;
    EXPECT_THAT(missing.err, HasSubstr("none.yaml"));
    const ProgramRun other_schema = run_program(command + "'" + truth + "'");
    EXPECT_EQ(other_schema.exit_code, 3) << other_schema.out;
    EXPECT_THAT(other_schema.err, HasSubstr("crumple-stations/1"));
  }
  for (const std::string verb : {"track", "reconstruct"}) {
    const ProgramRun markers = run_program(verb + " '" + capture + "' --rig='" + system.rig() + "' --out='" +
                                           (home / "out").string() + "' --near=previous --pose=markers");
    EXPECT_EQ(markers.exit_code, 2) << verb;
    EXPECT_THAT(markers.err, HasSubstr("--near wants --pose=pixels")) << verb;
  }
  EXPECT_FALSE(std::filesystem::exists(home / "out"));
}

}  // namespace
}  // namespace crumple
