#include "datasets/capture.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/check_capture.h"
#include "tests/datasets/public_data.h"

namespace crumple {
namespace {

using ::testing::HasSubstr;
using Kind = FrameContent::Kind;

const std::string kValid = R"(schema: crumple-capture/1
title: A bench test
images: frames
sensors:
  cam: {kind: camera, size_px: [640, 480], files: "{station}/{sensor}_{frame:03}.png", frame_offset: 1}
  proj: {kind: projector, size_px: [64, 48], lens: LENSMODEL_PINHOLE}
board: {kind: chessboard, inner_corners: [9, 7], pitch_mm: 30.5}
patterns:
  projector: proj
  orientations:
    - {angle_deg: 0, stripe_width_px: 1, bits: 6}
    - {angle_deg: 90, stripe_width_px: 2, bits: 5, code_offset: 3, inverse: false}
  chessboard: {inner_corners: [5, 4], first_corner_px: [10, 8], pitch_px: 8}
frames: [ambient, {stripes: 0}, unused, {stripes: 1}, white, black, chessboard]
stations: [a, {id: b, board: false}, {id: c, name_in_files: pose/3}]
exclude: [{station: b, sensor: cam, reason: a hand was in view}]
)";

// kValid with one piece of text replaced; the piece must be there.
std::string with(const std::string& piece, const std::string& replacement) {
  std::string text = kValid;
  const std::size_t at = text.find(piece);
  EXPECT_NE(at, std::string::npos) << piece;
  return at == std::string::npos ? text : text.replace(at, piece.size(), replacement);
}

std::string error_of(const std::string& text) {
  const auto capture = parse_capture(text, "capture.yaml");
  return capture ? "" : capture.error().message;
}

TEST(Capture, KeepsWhatTheDescriptionSays) {
  const auto capture = parse_capture(kValid, "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->title, "A bench test");
  ASSERT_EQ(capture->sensors.size(), 2U);
  EXPECT_EQ(capture->sensors[0].lens_model, "LENSMODEL_OPENCV5");
  EXPECT_EQ(capture->sensors[1].kind, SensorKind::projector);
  EXPECT_EQ(capture->sensors[1].lens_model, "LENSMODEL_PINHOLE");
  EXPECT_EQ(capture->sensors[0].size, (ImageSize{640, 480}));
  ASSERT_EQ(capture->boards.size(), 1U);
  EXPECT_EQ(capture->boards[0].target.columns, 9);
  EXPECT_EQ(capture->boards[0].target.rows, 7);
  EXPECT_EQ(capture->boards[0].target.pitch_mm, 30.5);
  EXPECT_NEAR(capture->orientations[1].angle_rad, M_PI / 2, 1e-15);
  EXPECT_EQ(capture->orientations[1].code_offset, 3);
  EXPECT_EQ(capture->projected_chessboard->first_corner_px, Eigen::Vector2d(10, 8));
  EXPECT_EQ(capture->stations[0].boards.size(), 1U);
  EXPECT_TRUE(capture->stations[1].boards.empty());
  EXPECT_EQ(capture->exclusion("b", "cam")->reason, "a hand was in view");
  EXPECT_FALSE(capture->exclusion("a", "cam"));
}

TEST(Capture, ExpandsTheCompactFrameList) {
  const auto capture = parse_capture(kValid, "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  ASSERT_EQ(capture->frames.size(), 1U + 12 + 5 + 3);
  EXPECT_EQ(capture->frames[0].kind, Kind::ambient);
  EXPECT_EQ(frame_words(capture->frames[3]), "bit 1 of orientation 0");
  EXPECT_EQ(frame_words(capture->frames[4]), "the inverse of bit 1 of orientation 0");
  EXPECT_EQ(frame_words(capture->frames[14]), "bit 1 of orientation 1");
  EXPECT_EQ(capture->find_frame(Kind::white), 18U);
  // The unused image takes a number, and files are counted from 1.
  EXPECT_EQ(capture->image_file("cam", "a", 12), "frames/a/cam_013.png");
  EXPECT_EQ(capture->image_file("cam", "c", 13), "frames/pose/3/cam_015.png");
}

TEST(Capture, TakesSingleFramesAndOtherOrders) {
  const std::string frames = with("{stripes: 1}",
                                  "{orientation: 1, bit: 4}, {orientation: 1, bit: 3}, {orientation: 1, bit: 2}, "
                                  "{orientation: 1, bit: 1}, {orientation: 1, bit: 0}");
  const auto single = parse_capture(frames, "capture.yaml");
  ASSERT_TRUE(single) << single.error().message;
  EXPECT_EQ(single->frames[13].bit, 4);

  const auto other = parse_capture(
      with("{stripes: 0}", "{stripes: 0, show: inverses, order: finest_first}, {stripes: 0, show: patterns}"),
      "c.yaml");
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(frame_words(other->frames[1]), "the inverse of bit 5 of orientation 0");
  EXPECT_EQ(frame_words(other->frames[7]), "bit 0 of orientation 0");
}

TEST(Capture, TakesNamesForFrames) {
  const auto capture = parse_capture(R"(
schema: crumple-capture/1
title: Named frames
sensors:
  cam: {kind: camera, size_px: [640, 480], files: "{station}_{frame_name}.tif"}
  proj: {kind: projector, size_px: [64, 48]}
patterns: {projector: proj}
frames: [white, black]
frame_names: [lit, dark]
stations: ["1"]
)",
                                     "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->image_file("cam", "1", 1), "1_dark.tif");
}

struct Mistake {
  std::string piece;
  std::string replacement;
  std::string place;  // text in the changed description that the error must point at
  std::string sentence;
};

std::ostream& operator<<(std::ostream& out, const Mistake& mistake) {
  return out << mistake.piece << " -> " << mistake.replacement;
}

// "line:column" of a piece of text, both from 1.
std::string place_of(const std::string& piece, const std::string& text) {
  const std::size_t at = text.find(piece);
  EXPECT_NE(at, std::string::npos) << piece;
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
  const std::size_t start = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
  return std::to_string(line) + ":" + std::to_string(at - start + 1);
}

class CaptureMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(CaptureMistake, IsNamedWithItsPlace) {
  const std::string text = with(GetParam().piece, GetParam().replacement);
  const std::string message = error_of(text);
  EXPECT_THAT(message, HasSubstr("capture.yaml:" + place_of(GetParam().place, text) + ": "));
  EXPECT_THAT(message, HasSubstr(GetParam().sentence));
}

INSTANTIATE_TEST_SUITE_P(
    All, CaptureMistake,
    ::testing::Values(
        Mistake{"capture/1", "capture/4", "crumple-capture/4",
                "must be crumple-capture/3 or crumple-capture/2 or crumple-capture/1, not `crumple-capture/4`"},
        Mistake{"title: A bench test", "", "schema", "`title` is missing"},
        Mistake{"title: A bench", "titel: A bench", "titel", "unknown key `titel`; did you mean `title`?"},
        Mistake{"title: A bench test", "title: [", ":\n  cam", "not valid YAML"},
        Mistake{"title: A bench test", "title:", "images", "must be a text, and is empty"},
        Mistake{"pitch_mm", "pitch_m", "pitch_m", "did you mean `pitch_mm`? (The unit is part of the key.)"},
        Mistake{"pitch_mm: 30.5", "pitch_mm: 30.5 mm", "30.5 mm", "must be a number above zero"},
        Mistake{"pitch_mm: 30.5", "pitch_mm: '30.5'", "'30.5'", "without quotes"},
        Mistake{"pitch_mm: 30.5", "pitch_mm: -1", "-1", "above zero"},
        Mistake{"pitch_mm: 30.5", "pitch_mm: .nan", ".nan", "above zero"},
        Mistake{"angle_deg: 0", "angle_rad: 0", "angle_rad", "did you mean `angle_deg`?"},
        Mistake{"[640, 480]", "[640, 0]", "0], files", "from 1 to 65500"},
        Mistake{"[640, 480]", "[640]", "[640]", "[width, height]"},
        Mistake{"size_px: [640", "size: [640", "size: ", "did you mean `size_px`?"},
        Mistake{"[64, 48]", "[64, 48], size_px: [64, 48]", "size_px: [64, 48], lens", "given twice"},
        Mistake{"LENSMODEL_PINHOLE", "OPENCV5", "OPENCV5", "not `OPENCV5`"},
        Mistake{"kind: camera", "kind: scanner", "scanner", "camera or projector"},
        Mistake{"{station}/", "", "\"{sensor}", "lacks {station}"},
        Mistake{"_{frame:03}", "", "\"{station}", "lacks {frame}"},
        Mistake{"{frame:03}", "{frame:3d}", "\"{station}", "{frame:02}"},
        Mistake{"{frame:03}", "{number}", "\"{station}", "unknown placeholder `{number}`"},
        Mistake{"{frame:03}", "{frame_name}", "\"{station}", "list the `frame_names`"},
        Mistake{"{station}/", "/data/{station}/", "\"/data", "must stay below the image folder"},
        Mistake{"{station}/", "../{station}/", "\"../", "must stay below the image folder"},
        Mistake{"{frame:03}.png", "{frame:03.png", "\"{station}", "without its"},
        Mistake{"projector: proj", "projector: cam", "cam\n", "`cam` is not a projector"},
        Mistake{"bits: 6", "bits: 5", "{angle_deg: 0", "cannot name"},
        Mistake{"bits: 6", "bits: 6.0", "6.0", "must be a whole number"},
        Mistake{"inverse: false", "inverse: no", "no}", "must be true or false"},
        Mistake{"pitch_px: 8", "pitch_px: 20", "{inner_corners: [5, 4]", "outside the 64 x 48 panel"},
        Mistake{"{stripes: 1}", "{stripes: 2}", "2}, white", "no orientation 2: the last one listed is 1"},
        Mistake{"{stripes: 1}, ", "", "[ambient", "orientation 1 lacks bit 0, bit 1, bit 2, bit 3, bit 4"},
        Mistake{"{stripes: 0}", "{stripes: 0}, {orientation: 0, bit: 3, inverse: true}", "[ambient",
                "shows more than once: the inverse of bit 3 of orientation 0 (frames 8 and 13)"},
        Mistake{"{stripes: 0}", "{orientation: 0, bit: 6}", "6}, unused", "from 0 to 5"},
        Mistake{"{stripes: 0}", "{stripes: 0, show: patterns}", "[ambient", "orientation 0 lacks the inverse of bit 0"},
        Mistake{"{stripes: 1}", "{stripes: 1, show: inverses}", "[ambient", "says `inverse: false`"},
        Mistake{"white, ", "", "[ambient", "has stripes but no white frame"},
        Mistake{"black, ", "", "[ambient", "orientation 1 has no inverses, so decoding needs a black frame"},
        Mistake{"white, ", "white, white, ", "[ambient", "shows more than once: white (frames 19 and 20)"},
        Mistake{"ambient", "abmient", "abmient", "not `abmient`"},
        Mistake{"stations: [a", "stations: [b", "{id: b", "station `b` is listed twice"},
        Mistake{"stations: [a", "stations: [..", "..,", "holds no slashes"},
        Mistake{"name_in_files: pose/3", "name_in_files: ../3", "../3", "stays below the image folder"},
        Mistake{"name_in_files: pose/3", "name_in_files: /3", "/3}", "stays below the image folder"},
        Mistake{"name_in_files: pose/3", "name_in_files: a", "{id: c", "stands for another station's files"},
        Mistake{"exclude: [{station: b", "exclude: [{station: z", "z, sensor", "there is no station `z`"},
        Mistake{", reason: a hand was in view", "", "{station: b", "`reason` is missing"}));

constexpr const char* kMovedTrackers = R"(
schema: crumple-capture/3
title: Trackers moved once, a bar put down twice
sensors:
  cam0: {kind: camera, size_px: [640, 480], files: "{station}/{sensor}.png"}
  track0: {kind: camera, mount: world, size_px: [640, 480], files: "{station}/{sensor}_{frame}.png", stations: [a, b]}
  track0b: {kind: camera, mount: world, size_px: [640, 480], files: "{station}/{sensor}_{frame}.png", stations: [c], lens_of: track0}
leds:
  p: {word: "0110"}
  e: {word: "0111", mount: world}
  f: {word: "0001", mount: world}
scale_bars:
  bar: {leds: [e, f], length_mm: 1200.5, certificate: {length_sigma_mm: 0.01}, placing_sigma_mm: 0.002, places: [[a], [b, c]]}
frames: [ambient]
tracker_frames: [{leds: 8}]
stations: [a, b, c]
)";

TEST(Capture, TakesMovedTrackersAndScaleBars) {
  const auto capture = parse_capture(kMovedTrackers, "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->sensor("track0b")->lens_of, "track0");
  EXPECT_TRUE(capture->took_images("track0", *capture->station("b")));
  EXPECT_FALSE(capture->took_images("track0", *capture->station("c")));
  EXPECT_TRUE(capture->took_images("track0b", *capture->station("c")));
  ASSERT_EQ(capture->scale_bars.size(), 1u);
  const CaptureBar& bar = capture->scale_bars[0];
  EXPECT_EQ(bar.length_mm, 1200.5);
  EXPECT_EQ(bar.certificate.pitch_sigma_mm, 0.01);
  EXPECT_FALSE(bar.certificate.expansion_sigma_per_k);  // not zero
  EXPECT_EQ(bar.places, (std::vector<std::vector<std::string>>{{"a"}, {"b", "c"}}));
}

class MovedTrackersMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(MovedTrackersMistake, IsNamed) {
  std::string text = kMovedTrackers;
  const std::size_t at = text.find(GetParam().piece);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, GetParam().piece.size(), GetParam().replacement);
  EXPECT_THAT(error_of(text), HasSubstr(GetParam().sentence));
}

INSTANTIATE_TEST_SUITE_P(
    All, MovedTrackersMistake,
    ::testing::Values(
        Mistake{"lens_of: track0}", "lens_of: cam0}", "", "fixed to the world that is listed before, not `cam0`"},
        Mistake{"lens_of: track0}", "lens_of: track1}", "", "listed before, not `track1`"},
        Mistake{"[640, 480], files: \"{station}/{sensor}_{frame}.png\", stations: [c]",
                "[640, 400], files: \"{station}/{sensor}_{frame}.png\", stations: [c]", "", "another size_px"},
        Mistake{"stations: [c]", "stations: [d]", "", "`track0b` names the station `d`"},
        Mistake{"leds: [e, f]", "leds: [e, p]", "", "not an LED of `leds` with `mount: world`"},
        Mistake{"leds: [e, f]", "leds: [e, e]", "", "two different LEDs"},
        Mistake{"certificate: {length_sigma_mm: 0.01}, ", "", "", "`certificate` is missing"},
        Mistake{"[[a], [b, c]]", "[[a], [a]]", "", "at two places at station `a`"}));

TEST(Capture, RefusesTwoImagesOfOneName) {
  std::string text = with("{station}/{sensor}_{frame:03}", "{station}{frame}");
  text.replace(text.find("stations: [a"), 12, "stations: [a, a1");
  EXPECT_THAT(error_of(text), HasSubstr("names two images a11.png"));
}

TEST(Capture, ReportsAllMistakesAtOnce) {
  std::string text = with("pitch_mm: 30.5", "pitch_mm: none");
  text.replace(text.find("bits: 6"), 7, "bits: x");
  const std::string message = error_of(text);
  EXPECT_THAT(message, HasSubstr("capture.yaml:7:"));
  EXPECT_THAT(message, HasSubstr("capture.yaml:11:"));
}

TEST(Capture, SurvivesTextThatIsNoDescription) {
  for (const std::string text :
       {"", "\n", "~", "3", "[1, 2]", "{", "a: *b", "&a [*a]", "---\na: 1\n---\nb: 2\n", "\xff\xfe", "? [1]: 2", ", a",
        "sensors: 3", "sensors: {cam: 3}", "frames: {a: b}", "stations: 7"}) {
    EXPECT_NE(error_of(text), "") << text;
  }
  EXPECT_NE(error_of(std::string(100000, '[')), "");
}

TEST(Capture, RefusesWhatAliasesBlowUp) {
  EXPECT_THAT(error_of("a: &a [*a]"), HasSubstr("without aliases"));
  std::string text = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int i = 1; i < 20; ++i) {
    const std::string below = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + below + ", " + below + "]\n";
  }
  EXPECT_THAT(error_of(text), HasSubstr("more than 200000 values"));
  EXPECT_EQ(error_of(with("size_px: [640, 480]", "size_px: &size [640, 480]")), "");
}

TEST(Capture, CountsImagesWithinBounds) {
  std::string unused;
  for (int i = 0; i < 22000; ++i) unused += "*u, ";
  EXPECT_THAT(error_of(with("unused, ", "&u {unused: 100000}, " + unused)), HasSubstr("counts to more than 1000000"));
}

TEST(Capture, SaysWhereItLookedForFiles) {
  EXPECT_THAT(read_capture("no/such/capture.yaml").error().message, HasSubstr("no/such/capture.yaml does not exist"));
}

TEST(CaptureExamples, DescribeTheirPublicImages) {
  const std::filesystem::path examples = std::filesystem::path(CRUMPLE_SOURCE_DIR) / "datasets/examples";
  for (const std::string name : {"procam", "stereo_chessboard"}) {
    const auto capture = read_capture(examples / (name + ".yaml"), examples);
    ASSERT_TRUE(capture) << capture.error().message;
    EXPECT_EQ(capture->boards.size(), 1U);
  }
}

// The descriptions that docs/formats.md shows.
TEST(CaptureExamples, OfTheDocumentationAreValid) {
  std::ifstream file(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "docs/formats.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string start = "```yaml\nschema: crumple-capture/3";
  int examples = 0;
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1), ++examples) {
    const std::size_t begin = text.find('\n', at) + 1;
    EXPECT_EQ(error_of(text.substr(begin, text.find("```", begin) - begin)), "");
  }
  EXPECT_EQ(examples, 3);
}

// Its first station. Errors at the others would stop its calibration in tests/cli/procam_test.cc; warnings there are
// looked for by no test.
TEST(CaptureExamples, ProcamChecksClean) {
  const auto data = public_data("procam");
  if (!data) GTEST_SKIP() << "the procam images are not here; name their parent folder in CRUMPLE_DATA";
  auto capture = read_capture(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "datasets/examples/procam.yaml", *data);
  ASSERT_TRUE(capture) << capture.error().message;
  capture->stations.resize(1);
  for (const Finding& finding : check_capture(*capture)) ADD_FAILURE() << finding.where << ": " << finding.sentence;
  const auto stripes = read_stripe_images(*capture, "camera", "0");
  ASSERT_TRUE(stripes) << stripes.error().message;
  EXPECT_EQ(stripes->stacks.size(), 2U);
  EXPECT_EQ(stripes->stacks[1].inverses.size(), 10U);
  EXPECT_EQ(stripes->white.size(), cv::Size(1280, 1024));
}

TEST(CaptureExamples, StereoChessboardChecksClean) {
  const auto data = public_data("stereo_chessboard");
  if (!data) GTEST_SKIP() << "the stereo images are not here; name their parent folder in CRUMPLE_DATA";
  auto capture =
      read_capture(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "datasets/examples/stereo_chessboard.yaml", *data);
  ASSERT_TRUE(capture) << capture.error().message;
  capture->stations.resize(2);
  for (const Finding& finding : check_capture(*capture)) {
    EXPECT_EQ(finding.severity, Severity::warning) << finding.where << ": " << finding.sentence;
  }
  const auto board = read_board_image(*capture, "right", "02");
  ASSERT_TRUE(board) << board.error().message;
  EXPECT_EQ(board->size(), cv::Size(640, 480));
}

}  // namespace
}  // namespace crumple
