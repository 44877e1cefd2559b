// What may be wrong with a tracked probe's capture or its rig, end to end: a sentence that names it, and exit code 3, 4
// or 5, never a number that looks fine.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/capture.h"
#include "datasets/rig_file.h"
#include "datasets/station_pose.h"
#include "solvers/rig_covariance.h"
#include "tests/cli/tracked_system.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

// tests/data/scenes/tracked.yaml; the last differs from each of its words at every turn, and no LED blinks it.
constexpr const char* kWordOfA = "1111101101000000";
constexpr const char* kWordOfB = "0000011001110111";
constexpr const char* kWordOfC = "0010110111111000";
constexpr const char* kWordOfD = "1100110010001111";
constexpr const char* kWordOfNone = "0000100100100111";

// At these both trackers see all LEDs of the probe.
constexpr const char* kFewStations =
    "  - {id: cal_02, placement: bench_a}\n"
    "  - {id: cal_03, placement: bench_a}\n"
    "  - {id: cal_07, placement: bench_b}\n";

// The description with words that are not those that the LEDs blink, beside its images.
std::string with_words(const std::string& name, const std::vector<std::pair<std::string, std::string>>& changes) {
  const fs::path folder = TrackedSystem::get().capture();
  std::string text = content_of(folder / "capture.yaml");
  for (const auto& [from, to] : changes) text.replace(text.find(from), from.size(), to);
  write_content(folder / name, text);
  return (folder / name).string();
}

std::string swapped_words() {
  return with_words("swapped.yaml", {{kWordOfA, "once a's"}, {kWordOfC, kWordOfA}, {"once a's", kWordOfC}});
}

ProgramRun calibrate(const std::string& capture, const std::string& flags, const fs::path& out) {
  return run_program(
      fmt::format("calibrate '{}' --nooverlays --noreport --json --out='{}' {}", capture, out.string(), flags));
}

std::vector<std::string> reasons_of(const ProgramRun& run) { return json::parse(run.out)["reasons"]; }

std::vector<std::string> names_of(const Rig& rig) {
  std::vector<std::string> names;
  for (const Led& led : rig.leds) names.push_back(led.name);
  return names;
}

std::vector<std::string> reasons_of_skipped(const ProgramRun& run) {
  const json summary = json::parse(run.out);
  std::vector<std::string> reasons;
  for (const json& view : summary["skipped"]) reasons.push_back(view["reason"]);
  return reasons;
}

TEST(TrackedBadInput, CalibrateNamesLedsWhoseWordsAreSwapped) {
  const TemporaryFolder home;
  const ProgramRun run = calibrate(swapped_words(), "", home / "rig");
  ASSERT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(reasons_of(run), Contains(HasSubstr("LEDs a and c seem swapped")));
}

TEST(TrackedBadInput, TrackNamesLedsWhoseWordsAreSwapped) {
  const TemporaryFolder home;
  const ProgramRun run =
      run_program(fmt::format("track '{}' --rig='{}' --stations=cal_01,cal_05,wand_1 --out='{}'", swapped_words(),
                              TrackedSystem::get().rig(), (home / "poses").string()));
  EXPECT_EQ(run.exit_code, 3) << run.out;
  for (const char* const station : {"cal_01", "cal_05", "wand_1"}) {
    EXPECT_THAT(run.err, HasSubstr(fmt::format("station {}: LEDs a and c seem swapped", station)));
  }
  EXPECT_FALSE(fs::exists(home / "poses"));
}

// The capture with the images of some stations in other trackers' folders.
class MixedFolders {
 public:
  MixedFolders() { fs::copy(TrackedSystem::get().capture(), capture(), fs::copy_options::recursive); }
  fs::path capture() const { return home_ / "capture"; }
  void move(const std::string& from, const std::string& to) const { fs::rename(capture() / from, capture() / to); }
  void copy_over(const std::string& from, const std::string& to) const {
    fs::remove_all(capture() / to);
    fs::copy(capture() / from, capture() / to, fs::copy_options::recursive);
  }

 private:
  TemporaryFolder home_;
};

TEST(TrackedBadInput, TrackNamesTrackersWithOthersImages) {
  const MixedFolders mixed;
  mixed.copy_over("cal_02/tracker0", "cal_02/tracker1");
  mixed.copy_over("cal_03/tracker1", "cal_07/tracker1");
  mixed.move("cal_03/tracker0", "cal_03/own");
  mixed.move("cal_03/tracker1", "cal_03/tracker0");
  mixed.move("cal_03/own", "cal_03/tracker1");
  const TemporaryFolder home;
  for (const std::string pose : {"pixels", "markers"}) {
    const ProgramRun run = run_program(fmt::format(
        "track '{}' --rig='{}' --stations=cal_02,cal_03,cal_07 --pose={} --out='{}'",
        (mixed.capture() / "capture.yaml").string(), TrackedSystem::get().rig(), pose, (home / pose).string()));
    EXPECT_EQ(run.exit_code, 3) << run.out;
    EXPECT_THAT(run.err, HasSubstr("station cal_02: tracker0 and tracker1 have the same images"));
    EXPECT_THAT(run.err, HasSubstr("station cal_03: tracker0 and tracker1 seem to have each other's images"));
    EXPECT_THAT(run.err, HasSubstr("station cal_07: tracker0 and tracker1 tell poses"));
    EXPECT_FALSE(fs::exists(home / pose));
  }
}

TEST(TrackedBadInput, TwoLedsWithTheSameWordAreRefused) {
  const std::string capture = with_words("same_word.yaml", {{kWordOfC, kWordOfB}});
  const TemporaryFolder home;
  const std::string rig = fmt::format("' --rig='{}' --out='{}'", TrackedSystem::get().rig(), (home / "out").string());
  for (const std::string& verb : {"check '" + capture + "'", "track '" + capture + rig,
                                  "calibrate '" + capture + "' --out='" + (home / "out").string() + "'"}) {
    const ProgramRun run = run_program(verb);
    EXPECT_EQ(run.exit_code, 3) << verb << run.out;
    EXPECT_THAT(run.err, AllOf(HasSubstr("same_word.yaml:"), HasSubstr("two LEDs have the word"), HasSubstr(kWordOfB)))
        << verb;
  }
  EXPECT_FALSE(fs::exists(home / "out"));
}

// An LED that capture.yaml describes and no image shows.
TEST(TrackedBadInput, AnLedThatWasNeverReadIsNamedAndNotInTheRig) {
  const TrackedSystem& system = TrackedSystem::get();
  const fs::path capture = system.with_stations("unlit.yaml", kFewStations);
  replace_in(capture, "\nleds:\n", fmt::format("\nleds:\n  \"unlit\": {{word: \"{}\"}}\n", kWordOfNone));
  const TemporaryFolder home;
  const ProgramRun run = calibrate(capture.string(), "--start='" + system.rig() + "'", home / "rig");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: LED unlit is left out: it was never read"));
  EXPECT_THAT(reasons_of_skipped(run), Contains(HasSubstr("LED unlit is left out: it was never read")));
  EXPECT_FALSE(json::parse(run.out)["leds"].contains("unlit"));
  EXPECT_THAT(names_of(read_rig(home / "rig").value()), testing::UnorderedElementsAre("a", "b", "c", "d", "e"));
}

// LED d is not told in an interim capture: the rig that comes of it still tracks the usual one.
TEST(TrackedBadInput, AnLedThatTheEarlierRigKnowsStaysThoughItWasNotRead) {
  const TrackedSystem& system = TrackedSystem::get();
  const fs::path capture = system.with_stations("hidden.yaml", kFewStations);
  replace_in(capture, kWordOfD, kWordOfNone);
  const TemporaryFolder home;
  const ProgramRun run = calibrate(capture.string(), "--start='" + system.rig() + "'", home / "rig");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: LED d keeps what the earlier rig says of it: it was never read"));
  EXPECT_THAT(reasons_of_skipped(run), Contains(HasSubstr("LED d keeps what the earlier rig says of it")));
  const Rig earlier = read_rig(system.rig()).value(), rig = read_rig(home / "rig").value();
  ASSERT_THAT(names_of(rig), testing::UnorderedElementsAre("a", "b", "c", "d", "e"));
  const auto place_of_d = [](const Rig& of) {
    return std::find_if(of.leds.begin(), of.leds.end(), [](const Led& led) { return led.name == "d"; })->position_mm;
  };
  const std::vector<std::string> rows{"d.x", "d.y", "d.z"};
  const Eigen::Matrix3d before = covariance_of(earlier.covariance, rows), after = covariance_of(rig.covariance, rows);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(after(i, i), 0.1 * before(i, i));
    EXPECT_LT(after(i, i), 1.5 * before(i, i));
    EXPECT_LT(std::abs((place_of_d(rig) - place_of_d(earlier))[i]), 4 * std::sqrt(before(i, i)));
  }
  const ProgramRun tracked =
      run_program(fmt::format("track '{}/capture.yaml' --rig='{}' --stations=cal_02,cal_07 --out='{}'",
                              system.capture(), (home / "rig").string(), (home / "poses").string()));
  EXPECT_EQ(tracked.exit_code, 0) << tracked.err;
}

// Wherever LED c is, what is around LED b in the same image.
void let_c_blink_as_b(const Capture& capture, const Rig& rig, const std::string& station) {
  constexpr int kHalf = 7;
  const StationPose pose = station_pose(capture, rig, station).value();
  const auto c = std::find_if(rig.leds.begin(), rig.leds.end(), [](const Led& led) { return led.name == "c"; });
  for (const LedReading& reading : pose.constellation.readings) {
    const Sensor& tracker = rig.sensors[reading.view.sensor];
    const auto to =
        tracker.lens.project(tracker.sensor_from_mount * (pose.constellation.pose.world_from_probe * c->position_mm));
    ASSERT_TRUE(to);
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      if (rig.leds[reading.view.leds[i]].name != "b") continue;
      const auto around = [&](const Eigen::Vector2d& pixel) {
        return cv::Rect(static_cast<int>(std::lround(pixel.x())) - kHalf,
                        static_cast<int>(std::lround(pixel.y())) - kHalf, 2 * kHalf + 1, 2 * kHalf + 1);
      };
      for (std::size_t frame = 0; frame < capture.frames_of(tracker.name).size(); ++frame) {
        const fs::path file = capture.image_file(tracker.name, station, frame);
        if (capture.frames_of(tracker.name)[frame].kind != FrameContent::Kind::leds || !fs::exists(file)) continue;
        cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
        image(around(reading.view.pixels[i])).clone().copyTo(image(around(*to)));
        ASSERT_TRUE(cv::imwrite(file.string(), image));
      }
    }
  }
}

// One word twice, the other never: this capture tells neither LED's place, which the earlier rig does.
TEST(TrackedBadInput, LedsOfWhichOneBlinksTheOthersWordAreNamedAndKeepTheirPlaces) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  fs::copy(system.capture(), home / "capture", fs::copy_options::recursive);
  const fs::path description = home / "capture/two_alike.yaml";
  fs::copy_file(system.with_stations("few_alike.yaml", kFewStations), description);
  const Capture capture = read_capture(description).value();
  const Rig rig = read_rig(system.rig()).value();
  for (const Station& station : capture.stations) let_c_blink_as_b(capture, rig, station.id);
  const ProgramRun run = calibrate(description.string(), "--start='" + system.rig() + "'", home / "rig");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  const std::string keeps = "keeps what the earlier rig says of it: ";
  EXPECT_THAT(reasons_of_skipped(run),
              AllOf(Contains(HasSubstr("LED c " + keeps + "it was never read")),
                    Contains(HasSubstr("LED b " + keeps + "wherever it is seen its word blinks at several places"))));
  EXPECT_THAT(run.err, AllOf(HasSubstr("warning: LED b keeps"), HasSubstr("warning: LED c keeps")));
  EXPECT_THAT(names_of(read_rig(home / "rig").value()), testing::UnorderedElementsAre("a", "b", "c", "d", "e"));
}

// From cal_06 on the images of tracker1 are those of one that was pushed by 6 mm and 0.3 degrees.
TEST(TrackedBadInput, ATrackerThatWasMovedHalfWayIsNamed) {
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  fs::copy(CRUMPLE_SOURCE_DIR "/tests/data/scenes/tracked.yaml", home / "pushed.yaml");
  const std::string before = content_of(home / "pushed.yaml");
  replace_in(home / "pushed.yaml", "[871.46, -85.51, 210.33]", "[876.46, -85.51, 214.33]");
  replace_in(home / "pushed.yaml", "[-0.504, -24.029, -8.678]", "[-0.504, -24.329, -8.678]");
  ASSERT_NE(content_of(home / "pushed.yaml"), before);
  const ProgramRun rendered =
      run_program(fmt::format("simulate '{}' --nodepth_maps --stations=cal_06,cal_07,cal_09,cal_10,wand_1 --out='{}'",
                              (home / "pushed.yaml").string(), (home / "pushed").string()));
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  fs::copy(system.capture(), home / "capture", fs::copy_options::recursive);
  for (const char* const station : {"cal_06", "cal_07", "cal_09", "cal_10", "wand_1"}) {
    const fs::path of_tracker = fs::path(station) / "tracker1";
    fs::remove_all(home / "capture" / of_tracker);
    fs::copy(home / "pushed" / of_tracker, home / "capture" / of_tracker);
  }
  // What the board shows is over by then: a tracker's view of it does not say when it was.
  std::string stations;
  for (int i = 1; i <= 8; ++i)
    stations += fmt::format("  - {{id: shown_0{}, placement: shown_0{}, scan: false}}\n", i, i);
  for (const int i : {1, 2, 3, 5}) stations += fmt::format("  - {{id: cal_0{}, placement: bench_a}}\n", i);
  for (const char* const station : {"cal_06", "cal_07", "cal_09", "cal_10", "wand_1"}) {
    stations += fmt::format("  - {{id: {}, board: false, scan: false}}\n", station);
  }
  fs::copy_file(system.with_stations("half_way.yaml", stations), home / "capture/half_way.yaml");
  const ProgramRun run = calibrate((home / "capture/half_way.yaml").string(), "", home / "rig");
  ASSERT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(reasons_of(run), Contains(HasSubstr("tracker1 stood elsewhere from station cal_06 on")));
}

// The probe's LEDs at other places, under the same names.
Rig rig_of_another_probe() {
  Rig rig = read_rig(TrackedSystem::get().rig()).value();
  for (std::size_t l = 0; l < rig.leds.size(); ++l) {
    const double turn = 1.7 * static_cast<double>(l);
    rig.leds[l].position_mm += 40 * Eigen::Vector3d(std::cos(turn), std::sin(turn), std::sin(2 * turn));
  }
  return rig;
}

TEST(TrackedBadInput, CalibrateDoubtsTheRigOfAnotherProbe) {
  const TemporaryFolder home;
  fs::create_directory(home / "other");
  ASSERT_TRUE(write_rig(home / "other", rig_of_another_probe()));
  const std::string few = TrackedSystem::get().with_stations("few_of_another.yaml", kFewStations);
  const ProgramRun run = calibrate(few, "--start='" + (home / "other").string() + "'", home / "rig");
  ASSERT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(reasons_of(run), Contains(HasSubstr("is this another probe or tracker?")));
}

TEST(TrackedBadInput, CheckFindsTheRigOfAnotherProbeInvalid) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), rig_of_another_probe()));
  const std::string few = TrackedSystem::get().with_stations("few_to_check.yaml", kFewStations);
  const ProgramRun run = run_program("check '" + few + "' --json --rig='" + home.path().string() + "'");
  ASSERT_EQ(run.exit_code, 4) << run.err << run.out;
  const json rig = json::parse(run.out)["rig"];
  EXPECT_FALSE(rig["valid"]);
  EXPECT_FALSE(rig["changed"].empty());
}

// A rig whose camera is another's by name.
TEST(TrackedBadInput, CalibrateRefusesARigWithoutTheProbesCamera) {
  const TemporaryFolder home;
  fs::create_directory(home / "other");
  Rig other = read_rig(TrackedSystem::get().rig()).value();
  other.sensors[*other.find("cam0")].name = "left";
  for (std::string& name : other.covariance.names) {
    if (name.starts_with("cam0.")) name.replace(0, 4, "left");
  }
  other.sigma_px.clear();
  ASSERT_TRUE(write_rig(home / "other", other));
  const std::string few = TrackedSystem::get().with_stations("few_of_left.yaml", kFewStations);
  const ProgramRun run = calibrate(few, "--start='" + (home / "other").string() + "'", home / "rig");
  EXPECT_EQ(run.exit_code, 3) << run.out;
  EXPECT_THAT(run.err, HasSubstr("the rig has no sensor cam0"));
  EXPECT_FALSE(fs::exists(home / "rig"));
}

// Two stations of a scan, of which the second shows no LED lit.
TEST(TrackedBadInput, AScanWithTooFewLedsFailsAloneWithItsReason) {
  const TemporaryFolder home;
  const fs::path capture = home / "capture";
  const ProgramRun rendered = run_program("simulate '" CRUMPLE_SOURCE_DIR
                                          "/datasets/scenes/tracked_small.yaml' --nodepth_maps --stations=door_1 "
                                          "--out='" +
                                          capture.string() + "'");
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  fs::copy(capture / "door_1", capture / "unlit", fs::copy_options::recursive);
  const Capture described = read_capture(capture / "capture.yaml").value();
  for (const std::string tracker : {"tracker0", "tracker1"}) {
    const fs::path folder = capture / "unlit" / tracker;
    const fs::path ambient = folder / described.image_file(tracker, "door_1", 0).filename();
    for (std::size_t frame = 1; frame < described.frames_of(tracker).size(); ++frame) {
      fs::copy_file(ambient, folder / described.image_file(tracker, "door_1", frame).filename(),
                    fs::copy_options::overwrite_existing);
    }
  }
  const std::string whole = content_of(capture / "capture.yaml");
  write_content(capture / "few.yaml", whole.substr(0, whole.find("\nstations:")) +
                                          "\nstations:\n"
                                          "  - {id: lit, name_in_files: door_1, board: false}\n"
                                          "  - {id: unlit, board: false}\n");
  for (const std::string verb : {"track", "reconstruct"}) {
    const ProgramRun run =
        run_program(fmt::format("{} '{}' --rig='{}' --json --out='{}'", verb, (capture / "few.yaml").string(),
                                (capture / "truth/rig").string(), (home / verb).string()));
    ASSERT_EQ(run.exit_code, 5) << verb << run.err;
    const json summary = json::parse(run.out);
    ASSERT_EQ(summary["failed"].size(), 1U) << verb;
    EXPECT_EQ(summary["failed"][0]["id"], "unlit") << verb;
    EXPECT_THAT(summary["failed"][0]["reason"].get<std::string>(),
                HasSubstr("station unlit: 0 LEDs of the probe are told: a pose needs three"))
        << verb;
    EXPECT_EQ(summary["stations"].size(), 1U) << verb;
    EXPECT_TRUE(fs::exists(home / verb / (verb == "track" ? "poses.csv" : "cloud.ply")));
  }
}

}  // namespace
}  // namespace crumple
