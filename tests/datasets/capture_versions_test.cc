// One description of every version of crumple-capture that ever was, in tests/data/captures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/capture.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path fixture(int version) {
  return std::filesystem::path(CRUMPLE_SOURCE_DIR) /
         ("tests/data/captures/version_" + std::to_string(version) + ".yaml");
}

TEST(CaptureVersions, OneIsRead) {
  const auto capture = read_capture(fixture(1));
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->schema, 1);
  ASSERT_EQ(capture->boards.size(), 1U);
  EXPECT_EQ(capture->boards[0].name, "board");
  EXPECT_EQ(capture->boards[0].target.kind, TargetKind::chessboard);
  EXPECT_FALSE(capture->boards[0].certificate);
  EXPECT_THAT(capture->stations[0].boards, ElementsAre(0));
  EXPECT_TRUE(capture->stations[1].boards.empty());
  EXPECT_EQ(capture->frames.size(), 43U);
  EXPECT_TRUE(capture->exclusion("a", "left"));
}

TEST(CaptureVersions, TwoIsRead) {
  const auto capture = read_capture(fixture(2));
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->schema, 2);
  EXPECT_EQ(capture->record.operator_name, "A. Surveyor");
  EXPECT_EQ(capture->record.temperature->celsius, 22.5);
  EXPECT_EQ(capture->sensors[0].serial, "C-0815");
  ASSERT_EQ(capture->boards.size(), 3U);
  const BoardSpec& large = capture->boards[0];
  EXPECT_EQ(large.name, "large");
  EXPECT_EQ(large.target.kind, TargetKind::charuco);
  EXPECT_EQ(large.target.mark_mm, 18);
  EXPECT_EQ(large.certificate->pitch_sigma_mm, 0.002);
  EXPECT_EQ(*large.certificate->expansion_per_k, 9e-6);
  EXPECT_EQ(large.certificate->expansion_sigma_per_k, 1e-6);
  EXPECT_EQ(capture->boards[1].target.first_id, 100);
  EXPECT_TRUE(capture->boards[2].target.staggered);
  EXPECT_THAT(capture->stations[0].boards, ElementsAre(0, 1, 2));
  EXPECT_TRUE(capture->stations[1].boards.empty());
  EXPECT_THAT(capture->stations[2].boards, ElementsAre(0, 2));
}

TEST(CaptureVersions, ThreeIsRead) {
  const auto capture = read_capture(fixture(3));
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->schema, 3);
  EXPECT_EQ(capture->sensor("cam0")->mount, Mount::probe);
  EXPECT_EQ(capture->sensor("tracker1")->mount, Mount::world);
  ASSERT_EQ(capture->leds.size(), 3U);
  EXPECT_EQ(capture->leds[0].word, "0110");
  EXPECT_FALSE(capture->leds[0].nominal_mm);
  EXPECT_EQ(*capture->leds[1].nominal_mm, Eigen::Vector3d(10, -20, 30.5));
  EXPECT_EQ(capture->leds[2].mount, Mount::world);
  EXPECT_EQ(capture->frames_of("cam0").size(), 17U);
  EXPECT_EQ(capture->frames_of("tracker0").size(), 7U);
  EXPECT_EQ(frame_words(capture->frames_of("tracker0")[6]), "step 5 of the blinking");
  EXPECT_EQ(capture->frames_of("thermal").size(), 1U);
  EXPECT_EQ(capture->find_frame(FrameContent::Kind::ambient, "tracker1"), 0U);
  EXPECT_EQ(capture->image_file("tracker1", "one", 6), fixture(3).parent_path() / "./one/tracker1/7.png");
  EXPECT_EQ(capture->image_file("cam0", "one", 1), fixture(3).parent_path() / "./one/cam0/003.png");
  EXPECT_EQ(capture->stations[0].placement, "bench");
  EXPECT_EQ(capture->stations[3].placement, "");
  EXPECT_FALSE(capture->took_images("cam0", capture->stations[2]));
  EXPECT_TRUE(capture->took_images("tracker0", capture->stations[2]));
  EXPECT_FALSE(capture->took_images("tracker0", capture->stations[3]));
  EXPECT_FALSE(capture->took_images("proj0", capture->stations[0]));
}

std::string error_in(int version, const std::string& old_text, const std::string& new_text) {
  std::string text = content_of(fixture(version));
  const std::size_t at = text.find(old_text);
  EXPECT_NE(at, std::string::npos) << old_text;
  text.replace(at, old_text.size(), new_text);
  const auto capture = parse_capture(text, "v.yaml");
  return capture ? "" : capture.error().message;
}

std::string error_with(const std::string& old_text, const std::string& new_text) {
  return error_in(2, old_text, new_text);
}

TEST(CaptureVersions, AKeyNeedsItsVersion) {
  EXPECT_THAT(error_with("crumple-capture/2", "crumple-capture/1"), HasSubstr("schema: has no `operator` yet"));
  EXPECT_EQ(error_with("crumple-capture/2", "crumple-capture/3"), "");
  EXPECT_THAT(error_with("crumple-capture/2", "crumple-capture/4"), HasSubstr("must be crumple-capture/3 or"));
  EXPECT_THAT(error_in(3, "crumple-capture/3", "crumple-capture/2"),
              AllOf(HasSubstr("sensors.tracker0.mount: is new in crumple-capture/3"),
                    HasSubstr("leds: is new in crumple-capture/3"), HasSubstr("stations[2].scan: is new")));
}

TEST(CaptureVersions, TrackersAreChecked) {
  EXPECT_THAT(error_in(3, "\"0110\"", "\"01102\""), HasSubstr("leds.a.word: must be 2 to 1000 characters"));
  EXPECT_THAT(error_in(3, "\"0110\"", "\"01101\""), HasSubstr("words of 5 and of 4 steps"));
  EXPECT_THAT(error_in(3, "\"0110\"", "\"1010\""), HasSubstr("two LEDs have the word 1010"));
  EXPECT_THAT(error_in(3, "[ambient, {leds: 6}]", "[ambient, {leds: 6}, ambient]"), HasSubstr("more than once"));
  EXPECT_THAT(error_in(3, "[ambient, {leds: 6}]", "[white]"), HasSubstr("tracker_frames[0]: must be ambient"));
  EXPECT_THAT(error_in(3, "tracker_frames:", "# tracker_frames:"), HasSubstr("`tracker_frames` is missing"));
  EXPECT_THAT(error_in(3, "frames: [white", "# frames: [white"), HasSubstr("`frames` is missing"));
  EXPECT_THAT(error_in(3, "trackers: false", "trackers: false, scan: false"), HasSubstr("neither a scan nor trackers"));
  EXPECT_THAT(error_in(3, "{frame:03}.png\"}\n  tracker1", "all.png\"}\n  tracker1"),
              HasSubstr("so all 7 frames would read the same image"));
}

TEST(CaptureVersions, TrackersAloneAreACapture) {
  const auto capture = parse_capture(
      "schema: crumple-capture/3\ntitle: trackers\nsensors:\n"
      "  t: {kind: camera, mount: world, size_px: [64, 48], files: \"{station}_{frame}.png\"}\n"
      "leds: {a: {word: \"01\"}}\ntracker_frames: [{leds: 2}]\nstations: [x, y]\n",
      "c.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_TRUE(capture->frames.empty());
}

TEST(CaptureVersions, BoardsAreChecked) {
  EXPECT_THAT(error_with("dictionary: 5X5_100", "dictionary: 5X5_99"), HasSubstr("`5X5_99` is no dictionary"));
  EXPECT_THAT(error_with("marker_mm: 18", "marker_mm: 25"), HasSubstr("leave 0.00 mm of white"));
  EXPECT_THAT(error_with("first_id: 100", "first_id: 580"), HasSubstr("has 0 to 586"));
  EXPECT_THAT(error_with("diameter_mm: 14", "diameter_mm: 29"), HasSubstr("they may be up to"));
  EXPECT_THAT(error_with("pitch_sigma_mm: 0.002", "pitch_sigma_mm: 0"), HasSubstr("pitch_sigma_mm"));
  EXPECT_THAT(error_with("boards: [large, spots]", "boards: [huge]"), HasSubstr("there is no board `huge`"));
  EXPECT_THAT(error_with("temperature_sigma_k: 0.5\n", ""), HasSubstr("temperature_sigma_k"));
  EXPECT_THAT(
      error_with(
          "kind: apriltag, markers: [5, 4], pitch_mm: 40, marker_mm: 32, dictionary: APRILTAG_36h11, first_id: 100",
          "kind: apriltag, markers: [5, 4], pitch_mm: 40, marker_mm: 32, dictionary: 5X5_100, first_id: 20"),
      HasSubstr("has markers in common with `large`"));
}

}  // namespace
}  // namespace crumple
