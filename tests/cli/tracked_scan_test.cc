// A tracked probe with a projector, from images to one cloud of the room: rendered, calibrated with a scale bar and a
// reference LED, reconstructed.
#include "tests/cli/tracked_scan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "datasets/capture.h"
#include "datasets/cloud_file.h"
#include "datasets/pose_csv.h"
#include "datasets/rig_file.h"
#include "solvers/distribution_tails.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kPitch_mm = 48, kStatedPitch_mm = 47.9;  // of the scene's board, and as it is described here

// Rendered and calibrated once for all tests of a program run.
class TrackedScan {
 public:
  static const TrackedScan& get() {
    static const TrackedScan scan;
    return scan;
  }

  std::filesystem::path capture() const { return home_ / "capture"; }
  std::filesystem::path rig() const { return home_ / "rig"; }
  const ProgramRun& rendered() const { return rendered_; }
  const ProgramRun& calibrated() const { return calibrated_; }

  // Of the description of that name, with the rig, against the truth.
  ProgramRun reconstruct(const std::string& description, const std::string& flags,
                         const std::filesystem::path& out) const {
    return run_program(fmt::format("reconstruct '{}' --rig='{}' --truth='{}' --json --out='{}' {}",
                                   (capture() / description).string(), (home_ / "rig").string(),
                                   (capture() / "truth").string(), out.string(), flags));
  }

 private:
  TrackedScan()
      : rendered_(run_program("simulate '" CRUMPLE_SOURCE_DIR
                              "/datasets/scenes/tracked_small.yaml' --nodepth_maps --out='" +
                              capture().string() + "'")) {
    replace_in(capture() / "capture.yaml", "pitch_mm: 48", fmt::format("pitch_mm: {}", kStatedPitch_mm));
    add_scale_bar(capture() / "capture.yaml");
    calibrated_ = run_program("calibrate '" + (capture() / "capture.yaml").string() +
                              "' --starts --nooverlays --noreport --json --out='" + (home_ / "rig").string() + "'");
  }

  TemporaryFolder home_;
  ProgramRun rendered_;
  ProgramRun calibrated_;
};

Eigen::Vector3d vector_of(const json& numbers) {
  return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

TEST(TrackedScanVerbs, CalibrateTakesTheScaleOfTheBar) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_EQ(scan.rendered().exit_code, 0) << scan.rendered().err;
  ASSERT_THAT(scan.calibrated().exit_code, AnyOf(0, 4)) << scan.calibrated().err;
  const json summary = json::parse(scan.calibrated().out);
  EXPECT_TRUE(std::any_of(summary["priors"].begin(), summary["priors"].end(), [](const json& prior) {
    return prior["name"] == "bar" && !prior["weak"];
  })) << summary["priors"];
  // Nothing but the bar tells lengths: it keeps its own within 4 sigmas of its certificate, and the board's pitch,
  // which is described wrongly by 60 of the certificate's sigmas, follows it. No scale is known better than
  // the bar.
  const json& leds = summary["leds"];
  const double length_mm = (vector_of(leds["bar_a"]["position_mm"]) - vector_of(leds["bar_b"]["position_mm"])).norm();
  EXPECT_NEAR(length_mm, kBar_mm, 4 * kBarSigma_mm);
  const double scale_sigma = summary["scale_uncertainty"].get<double>();
  EXPECT_GE(scale_sigma, kBarSigma_mm / kBar_mm);
  EXPECT_NEAR(summary["boards"]["board"]["scale"].get<double>(), kPitch_mm / kStatedPitch_mm, 4 * scale_sigma);
  EXPECT_LT(4 * scale_sigma, kPitch_mm / kStatedPitch_mm - 1);
  for (const json& note : summary["notes"]) EXPECT_THAT(note.get<std::string>(), Not(HasSubstr("size of board")));
}

// The room's LEDs are seen by both trackers at every station: their places are known, in the first tracker's frame.
TEST(TrackedScanVerbs, CalibrateFindsTheReferenceLedInTheRoom) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_THAT(scan.calibrated().exit_code, AnyOf(0, 4)) << scan.calibrated().err;
  const json summary = json::parse(scan.calibrated().out);
  const json& reference = summary["leds"]["reference"];
  EXPECT_EQ(reference["mount"], "world");
  const Eigen::Vector3d truth(618.3, -487.2, 2492.6);
  const Eigen::Vector3d off = vector_of(reference["position_mm"]) - truth, sigma = vector_of(reference["sigma_mm"]);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LE(std::abs(off[axis]), 4 * sigma[axis]) << "axis " << axis;
  EXPECT_EQ(summary["leds"]["a"]["mount"], "probe");
  EXPECT_EQ(summary["leds"].size(), 8U);
}

TEST(TrackedScanVerbs, ReconstructMergesStationsIntoOneCloudOfTheRoom) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const ProgramRun run =
      scan.reconstruct("capture.yaml", "--stations=door_1,door_2 --compare=closed_forms,stagewise", home / "cloud");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  const json& merged = summary["merged"]["weighted"];
  EXPECT_EQ(merged["stations"].size(), 2U);
  EXPECT_GT(merged["overlap_share"].get<double>(), 0.5);
  expect_as_good_as_stated(summary);
  const json& truth = summary["truth"];
  EXPECT_EQ(truth["world_raw_rms_mm"]["joint"], truth["estimators"]["weighted"]["trimmed_rms_mm"]);
  for (const char* const rig : {"closed_forms", "stagewise"}) {
    EXPECT_GT(truth["world_raw_rms_mm"][rig].get<double>(), truth["world_raw_rms_mm"]["joint"].get<double>()) << rig;
  }
  const Cloud cloud = read_cloud(home / "cloud/cloud.ply").value();
  EXPECT_EQ(cloud.frame, "world");
  EXPECT_THAT(cloud.stations, testing::ElementsAre("door_1", "door_2"));
  EXPECT_EQ(cloud.points.size(), summary["points"].get<std::size_t>());
  EXPECT_FALSE(cloud.shares.empty());
}

// A capture of door_1 and door_2, the LEDs of the latter all read after a push, each as often as the next.
std::filesystem::path pushed_unseen(const std::filesystem::path& capture) {
  const TrackedScan& scan = TrackedScan::get();
  std::filesystem::create_directory(capture);
  std::filesystem::copy(scan.capture() / "capture.yaml", capture);
  for (const char* const station : {"door_1", "door_2"}) {
    std::filesystem::copy(scan.capture() / station, capture / station, std::filesystem::copy_options::recursive);
  }
  for (const char* const tracker : {"tracker0", "tracker1"}) {
    std::filesystem::remove_all(capture / "door_2" / tracker);
    std::filesystem::copy(scan.capture() / "pushed" / tracker, capture / "door_2" / tracker,
                          std::filesystem::copy_options::recursive);
  }
  return capture / "capture.yaml";
}

// Only the surface tells.
TEST(TrackedScanVerbs, AStationThatLiesOffTheOthersIsNamed) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const std::string capture = pushed_unseen(home / "capture").string();
  const ProgramRun run =
      run_program(fmt::format("reconstruct '{}' --rig='{}' --stations=door_1,door_2 --json --out='{}'", capture,
                              scan.rig().string(), (home / "cloud").string()));
  EXPECT_EQ(run.exit_code, 4) << run.err;
  const json summary = json::parse(run.out);
  ASSERT_EQ(summary["reasons"].size(), 1U) << summary["merged"];
  EXPECT_THAT(summary["reasons"][0].get<std::string>(), AllOf(HasSubstr("station door_2 lies"), HasSubstr("mm off")));
  EXPECT_TRUE(std::filesystem::exists(home / "cloud/cloud.ply"));
}

// Nothing is refined under a rig that does not say what it may be off by, and nobody is told it was.
TEST(TrackedScanVerbs, ReconstructSaysWhereNothingWasRefined) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  std::filesystem::copy(scan.rig(), home / "rig", std::filesystem::copy_options::recursive);
  Rig rig = read_rig(home / "rig").value();
  rig.covariance = {};
  ASSERT_TRUE(write_rig(home / "rig", rig));
  const ProgramRun run = run_program(
      fmt::format("reconstruct '{}' --rig='{}' --stations=door_1,door_2 --refine_stations --out='{}'",
                  (scan.capture() / "capture.yaml").string(), (home / "rig").string(), (home / "cloud").string()));
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_THAT(run.out, HasSubstr("not refined: stations stay where their LEDs put them, for "));
  const json summary = json::parse(content_of(home / "cloud/summary.json"));
  EXPECT_THAT(summary["refined"]["refused"].get<std::string>(), HasSubstr("covariance"));
}

// Its images shifted, as a turn by 0.006 degrees would: of two trackers one or the other.
TEST(TrackedScanVerbs, TrackNamesTrackersOfWhichOneWasTurnedMeanwhile) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const std::filesystem::path capture = home / "capture";
  std::filesystem::copy(scan.capture(), capture, std::filesystem::copy_options::recursive);
  const cv::Matx23d shift(1, 0, 0.04, 0, 1, -0.04);
  for (const char* const station : {"cal_3", "door_1", "door_2"}) {
    for (const auto& file : std::filesystem::directory_iterator(capture / station / "tracker1")) {
      cv::Mat image = cv::imread(file.path().string(), cv::IMREAD_UNCHANGED);
      cv::warpAffine(image.clone(), image, shift, image.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
      ASSERT_TRUE(cv::imwrite(file.path().string(), image));
    }
  }
  const ProgramRun run =
      run_program(fmt::format("track '{}' --rig='{}' --stations=cal_1,cal_2,cal_3,door_1,door_2 --json --out='{}'",
                              (capture / "capture.yaml").string(), scan.rig().string(), (home / "poses").string()));
  ASSERT_EQ(run.exit_code, 4) << run.out << run.err;
  const json summary = json::parse(run.out);
  EXPECT_FALSE(summary["rig_check"]["valid"].get<bool>());
  EXPECT_THAT(summary["rig_check"].value("moved", ""), HasSubstr("tracker1 stood elsewhere from station cal_3 on"))
      << summary;
  EXPECT_TRUE(std::filesystem::exists(home / "poses/poses.csv"));
}

// The scene's ball bar and plate, exact: what is off is explained by what the program says of itself.
TEST(TrackedScanVerbs, MeasureTestsAgainstArtefacts) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const ProgramRun made = scan.reconstruct("capture.yaml", "--stations=bar_1,bar_2,table_1,table_2", home / "cloud");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Eigen::Vector3d turn = Eigen::Vector3d(18.417, -9.269, 8.533) * std::numbers::pi / 180;
  const Eigen::Vector3d middle(-131.71, -177.53, 2734.25);
  const Eigen::Vector3d half = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * Eigen::Vector3d(120, 0, 0);
  const auto sphere = [](const Eigen::Vector3d& at) {
    return fmt::format("{{near_mm: [{}, {}, {}], diameter_mm: 100, diameter_sigma_mm: 0.001}}", at.x(), at.y(), at.z());
  };
  write_content(
      home / "artefacts.yaml",
      fmt::format("schema: crumple-vdi2634/1\nspheres:\n  left: {}\n  right: {}\nplates:\n  plate: {{near_mm: "
                  "[-516.1, -184.07, 2752.63], radius_mm: 100}}\nball_bars:\n  bar: {{spheres: [left, right], "
                  "length_mm: 240, length_sigma_mm: 0.002}}\n",
                  sphere(middle - half), sphere(middle + half)));
  const ProgramRun run = run_program(
      fmt::format("measure '{}' --vdi2634='{}' --json", (home / "cloud").string(), (home / "artefacts.yaml").string()));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json results = json::parse(run.out)["results"];
  ASSERT_EQ(results.size(), 7U) << results;
  for (const json& result : results) {
    EXPECT_EQ(result["stations"], 2) << result;
    if (result.contains("within_U")) {
      EXPECT_TRUE(result["within_U"].get<bool>()) << result;
      EXPECT_LT(result["U"].get<double>(), 1) << result;
      continue;
    }
    const double observed_mm = result["observed_mm"].get<double>(), predicted_mm = result["predicted_mm"].get<double>();
    EXPECT_LT(observed_mm, 1.5 * predicted_mm) << result;
    EXPECT_GT(observed_mm, 0.67 * predicted_mm) << result;
  }
}

// A copy of the rig as if its calibration had rejected it.
std::filesystem::path rejected_rig(const std::filesystem::path& folder) {
  std::filesystem::copy(TrackedScan::get().rig(), folder, std::filesystem::copy_options::recursive);
  Rig rig = read_rig(folder).value();
  rig.rejected = true;
  rig.doubts = {"cam0: the focal length is known to 12.0 % only"};
  EXPECT_TRUE(write_rig(folder, rig));
  return folder;
}

TEST(TrackedScanVerbs, ARejectedRigIsNotUsedInSilence) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const std::string capture = (scan.capture() / "capture.yaml").string(), rig = rejected_rig(home / "rig").string();
  const std::string cloud = (home / "reconstruct").string();
  for (const std::string& command :
       {fmt::format("track '{}' --rig='{}' --stations=door_1 --out='{}'", capture, rig, (home / "track").string()),
        fmt::format("reconstruct '{}' --rig='{}' --stations=door_1 --out='{}'", capture, rig, cloud),
        fmt::format("measure '{}' --points='{}'", cloud, (home / "points.yaml").string())}) {
    if (command.starts_with("measure")) {
      const Eigen::Vector3d at = read_cloud(home / "reconstruct/cloud.ply").value().points.front().position_mm;
      write_content(home / "points.yaml", fmt::format("schema: crumple-measure/1\npoints:\n  one: {{near_mm: "
                                                      "[{}, {}, {}], radius_mm: 4}}\n",
                                                      at.x(), at.y(), at.z()));
    }
    const ProgramRun run = run_program(command);
    EXPECT_EQ(run.exit_code, 4) << command << run.err;
    EXPECT_THAT(run.out, HasSubstr("the rig was rejected when calibrated: cam0: the focal length is known to 12.0 %"))
        << command;
  }
}

TEST(TrackedScanVerbs, ReconstructPosesByMarkers) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const ProgramRun pixels = scan.reconstruct("capture.yaml", "--stations=door_1", home / "pixels");
  ASSERT_EQ(pixels.exit_code, 0) << pixels.err;
  const ProgramRun markers = scan.reconstruct("capture.yaml", "--stations=door_1 --pose=markers", home / "markers");
  ASSERT_EQ(markers.exit_code, 0) << markers.err;
  const json by_pixels = json::parse(pixels.out), by_markers = json::parse(markers.out);
  EXPECT_THAT(by_markers["uncertainty"]["lacks"].get<std::string>(), HasSubstr("markers"));
  // The same points at another place: a pose changes no shape, but for the rounding of room coordinates of 3 m.
  const Cloud one = read_cloud(home / "pixels/cloud.ply").value(),
              other = read_cloud(home / "markers/cloud.ply").value();
  ASSERT_EQ(one.points.size(), other.points.size());
  double changed_mm = 0;
  for (std::size_t i = 1; i < one.points.size(); ++i) {
    changed_mm = std::max(changed_mm, std::abs((one.points[i].position_mm - one.points[0].position_mm).norm() -
                                               (other.points[i].position_mm - other.points[0].position_mm).norm()));
  }
  EXPECT_LT(changed_mm, 1e-6);
  // Markers state no uncertainty. What the rig puts on the cloud is common to both ways, and is the larger part.
  EXPECT_LE(by_markers["truth"]["cloud_raw_rms_mm"]["weighted"].get<double>(), 4 * stated_mm(by_pixels));
  EXPECT_NE(by_markers["truth"]["cloud_raw_rms_mm"], by_pixels["truth"]["cloud_raw_rms_mm"]);
}

// The words of a and c are described as each other's; markers alone would have a pose for that.
TEST(TrackedScanVerbs, ReconstructNamesSwappedLedsWithEitherPose) {
  const TrackedScan& scan = TrackedScan::get();
  const std::string a = "1111111010000000", c = "0000111001111100";
  std::string text = content_of(scan.capture() / "capture.yaml");
  const std::size_t at_a = text.find(a), at_c = text.find(c);
  ASSERT_NE(at_a, std::string::npos);
  ASSERT_NE(at_c, std::string::npos);
  text.replace(at_a, a.size(), c).replace(at_c, c.size(), a);
  write_content(scan.capture() / "swapped.yaml", text);
  const TemporaryFolder home;
  for (const std::string pose : {"pixels", "markers"}) {
    const ProgramRun run = scan.reconstruct("swapped.yaml", "--stations=door_1 --pose=" + pose, home / pose);
    EXPECT_EQ(run.exit_code, 3) << pose << run.out;
    EXPECT_THAT(run.err, HasSubstr("station door_1: LEDs a and c seem swapped")) << pose;
    EXPECT_FALSE(std::filesystem::exists(home / pose)) << pose;
  }
}

// What LEDs alone say of the stations is not contradicted by what they share, which adds to it.
void expect_refined_within_leds(const json& refined, std::size_t stations) {
  ASSERT_EQ(refined["stations"].size(), stations);
  for (const json& station : refined["stations"]) {
    EXPECT_LE(station["sigma_mm"].get<double>(), station["sigma_by_leds_mm"].get<double>()) << station;
    EXPECT_LE(station["sigma_deg"].get<double>(), station["sigma_by_leds_deg"].get<double>()) << station;
    EXPECT_GT(station["moved_sigmas"].get<double>(), 0) << station;
    // Over six directions, in sigmas of what LEDs alone say: its square is no larger than a chi-square of six.
    EXPECT_LE(std::pow(station["moved_sigmas"].get<double>(), 2), chi_square_exceeded(1e-4, 6)) << station;
  }
  ASSERT_GE(refined["freedom"].get<int>(), 1);
  // LEDs and surface contradict each other by no more than chance.
  EXPECT_LE(refined["led_squares_grown_by"].get<double>(), chi_square_exceeded(1e-4, refined["freedom"].get<int>()));
}

TEST(TrackedScanVerbs, ReconstructRefinesStationsByTheirOverlap) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const ProgramRun run = scan.reconstruct("capture.yaml", "--stations=door_1,door_2 --refine_stations", home / "cloud");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  const json& refined = summary["refined"];
  ASSERT_FALSE(refined.contains("refused")) << refined;
  EXPECT_EQ(refined["overlaps"], 1);
  EXPECT_GT(refined["pairs"].get<int>(), 0);
  EXPECT_EQ(refined["targets"], 0);
  expect_refined_within_leds(refined, 2);
  expect_as_good_as_stated(summary);
}

// The board that stays at bench_a while the probe scans it from three stations: its 8 x 5 corners.
TEST(TrackedScanVerbs, ReconstructRefinesStationsByABoardThatStaysInTheRoom) {
  const TrackedScan& scan = TrackedScan::get();
  const TemporaryFolder home;
  const ProgramRun run =
      scan.reconstruct("capture.yaml", "--stations=cal_1,cal_2,cal_3 --refine_stations", home / "cloud");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  const json& refined = summary["refined"];
  ASSERT_FALSE(refined.contains("refused")) << refined;
  EXPECT_EQ(refined["targets"], 40);
  EXPECT_EQ(refined["targets_left_out"], 0);
  expect_refined_within_leds(refined, 3);
  expect_as_good_as_stated(summary);
}

// A description with these stations and door_2, the second half of whose images of the LEDs is taken from where the
// probe stood after a push by 1 mm.
void describe_with_push(const std::string& description, const std::string& stations) {
  using std::filesystem::copy_options;
  const TrackedScan& scan = TrackedScan::get();
  const std::filesystem::path pushed = scan.capture() / "door_2_pushed";
  std::filesystem::copy(scan.capture() / "door_2", pushed, copy_options::recursive | copy_options::overwrite_existing);
  const Capture capture = read_capture(scan.capture() / "capture.yaml").value();
  for (const std::string tracker : {"tracker0", "tracker1"}) {
    const std::size_t frames = capture.frames_of(tracker).size();
    for (std::size_t frame = frames - capture.leds.front().word.size(); frame < frames; ++frame) {
      const std::filesystem::path image = capture.image_file(tracker, "pushed", frame);
      std::filesystem::copy_file(image, pushed / tracker / image.filename(), copy_options::overwrite_existing);
    }
  }
  const std::string whole = content_of(scan.capture() / "capture.yaml");
  write_content(scan.capture() / description, whole.substr(0, whole.find("\nstations:")) + "\nstations:\n" + stations +
                                                  "  - {id: door_2, name_in_files: door_2_pushed, board: false}\n");
}

TEST(TrackedScanVerbs, AStationThatWasPushedBetweenReadingsIsNamedAndTheOtherIsWritten) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_EQ(scan.rendered().exit_code, 0) << scan.rendered().err;
  describe_with_push("pushed.yaml", "  - {id: door_1, board: false}\n");
  const TemporaryFolder home;
  const ProgramRun run = scan.reconstruct("pushed.yaml", "", home / "cloud");
  ASSERT_EQ(run.exit_code, 5) << run.err;
  const json summary = json::parse(run.out);
  ASSERT_EQ(summary["failed"].size(), 1U) << summary["failed"];
  EXPECT_EQ(summary["failed"][0]["id"], "door_2");
  EXPECT_THAT(summary["failed"][0]["reason"].get<std::string>(),
              AllOf(HasSubstr("station door_2: the probe or a tracker moved by up to "),
                    HasSubstr("between readings of the LEDs")));
  ASSERT_EQ(summary["stations"].size(), 1U);
  EXPECT_EQ(summary["stations"][0]["id"], "door_1");
  EXPECT_THAT(read_cloud(home / "cloud/cloud.ply").value().stations, testing::ElementsAre("door_1"));
}

// Its LEDs were read where it stood nowhere: a calibration and a check of the rig do without them, by name.
TEST(TrackedScanVerbs, CalibrateAndCheckLeaveOutAStationThatWasPushedBetweenReadings) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_THAT(scan.calibrated().exit_code, AnyOf(0, 4)) << scan.calibrated().err;
  const json sound = json::parse(scan.calibrated().out);
  for (const json& view : sound["skipped"]) {
    EXPECT_THAT(view["reason"].get<std::string>(), Not(HasSubstr("moved by up to"))) << view;
  }
  describe_with_push("pushed_few.yaml",
                     "  - {id: cal_1, placement: bench_a}\n"
                     "  - {id: cal_2, placement: bench_a}\n"
                     "  - {id: cal_3, placement: bench_a}\n");
  const std::string description = (scan.capture() / "pushed_few.yaml").string();
  const std::string warning = "station door_2: its LEDs are left out: the probe or a tracker moved by up to ";
  const TemporaryFolder home;
  const ProgramRun run =
      run_program(fmt::format("calibrate '{}' --start='{}' --nooverlays --noreport --json --out='{}'", description,
                              scan.rig().string(), (home / "rig").string()));
  ASSERT_THAT(run.exit_code, AnyOf(0, 4)) << run.err;
  EXPECT_THAT(run.err, HasSubstr(warning));
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["stations"], 3);
  const json& skipped = summary["skipped"];
  const auto moved =
      std::find_if(skipped.begin(), skipped.end(), [](const json& s) { return s["station"] == "door_2"; });
  ASSERT_NE(moved, skipped.end()) << skipped;
  EXPECT_EQ((*moved)["sensor"], "all trackers");
  EXPECT_THAT((*moved)["reason"].get<std::string>(), testing::StartsWith("the probe or a tracker moved by up to "));
  const ProgramRun check = run_program(fmt::format("check '{}' --rig='{}'", description, scan.rig().string()));
  EXPECT_THAT(check.exit_code, AnyOf(0, 4)) << check.out;
  EXPECT_THAT(check.err, HasSubstr(warning));
}

// The first half of the images of the LEDs alone: every word once.
TEST(TrackedScanVerbs, ReconstructSaysThatStillnessWasNotTested) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_EQ(scan.rendered().exit_code, 0) << scan.rendered().err;
  std::string text = content_of(scan.capture() / "capture.yaml");
  const std::string step = "  - {leds: 1}\n";
  text.erase(text.find(step), 16 * step.size());
  write_content(scan.capture() / "once.yaml", text);
  const TemporaryFolder home;
  const ProgramRun once =
      run_program(fmt::format("reconstruct '{}' --rig='{}' --stations=door_1 --out='{}'",
                              (scan.capture() / "once.yaml").string(), scan.rig().string(), (home / "once").string()));
  ASSERT_EQ(once.exit_code, 0) << once.err;
  EXPECT_THAT(once.out, HasSubstr("stillness was not tested at door_1: the LEDs' words were read once there"));
  const json summary = json::parse(content_of(home / "once/summary.json"));
  EXPECT_EQ(summary["stillness_not_tested"], json::array({"door_1"}));
  const ProgramRun twice = scan.reconstruct("capture.yaml", "--stations=door_1", home / "twice");
  ASSERT_EQ(twice.exit_code, 0) << twice.err;
  EXPECT_FALSE(json::parse(twice.out).contains("stillness_not_tested"));
}

// Markers have no covariance: whatever follows from one is not there, and the summary says why.
TEST(TrackedScanVerbs, TrackPosesByMarkers) {
  const TrackedScan& scan = TrackedScan::get();
  ASSERT_THAT(scan.calibrated().exit_code, AnyOf(0, 4)) << scan.calibrated().err;
  const TemporaryFolder home;
  const auto track = [&](const std::string& pose) {
    return run_program(fmt::format("track '{}' --rig='{}' --stations=door_1,door_2 --pose={} --json --out='{}'",
                                   (scan.capture() / "capture.yaml").string(), scan.rig().string(), pose,
                                   (home / pose).string()));
  };
  const ProgramRun pixels = track("pixels"), markers = track("markers"), neither = track("neither");
  ASSERT_EQ(pixels.exit_code, 0) << pixels.err;
  ASSERT_EQ(markers.exit_code, 0) << markers.err;
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("--pose=neither is neither pixels nor markers"));
  const json by_pixels = json::parse(pixels.out), by_markers = json::parse(markers.out);
  EXPECT_THAT(by_markers["uncertainty"]["lacks"].get<std::string>(), HasSubstr("markers"));
  EXPECT_FALSE(by_pixels.contains("uncertainty"));
  for (const char* station : {"door_1", "door_2"}) {
    const json &one = by_pixels["stations"][station], &other = by_markers["stations"][station];
    const double apart_mm = (vector_of(one["translation_mm"]) - vector_of(other["translation_mm"])).norm();
    EXPECT_GT(apart_mm, 0) << station;
    EXPECT_LT(apart_mm, 10) << station;
    for (const char* key : {"sigma_deg", "sigma_mm", "chi_square", "redundancy", "left_out"}) {
      EXPECT_TRUE(one.contains(key)) << key;
      EXPECT_FALSE(other.contains(key)) << key;
    }
    EXPECT_GT(one["stillness"]["degrees"], 0) << station;
    EXPECT_EQ(one["stillness"], other["stillness"]) << station;
  }
  EXPECT_THAT(content_of(home / "markers/poses.csv"),
              testing::StartsWith(std::string(kStationPoseColumns) + "\ndoor_1,"));
  EXPECT_TRUE(std::filesystem::exists(home / "pixels/stations.yaml"));
  EXPECT_FALSE(std::filesystem::exists(home / "markers/stations.yaml"));
}

}  // namespace
}  // namespace crumple
