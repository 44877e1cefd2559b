// Frames that were taken after the rig or the object was pushed, in captures that the program itself rendered.
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/simulated_capture.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kFrames = 28;  // 000 is white, 001 black, 002 to 027 are pairs of a pattern and its inverse

// A board and a panel, and the same again where they are after a push. Rendered once for all tests of a program run.
class PushedCapture {
 public:
  static const PushedCapture& get() {
    static const PushedCapture capture;
    return capture;
  }

  // Whose station's frames from one on are those of the other.
  void copy_to(const fs::path& folder, const std::string& station, const std::string& pushed, int from) const {
    fs::copy(home_ / "capture", folder, fs::copy_options::recursive);
    for (int frame = from; frame < kFrames; ++frame) {
      const std::string image = fmt::format("cam0/{:03}.png", frame);
      fs::copy_file(folder / pushed / image, folder / station / image, fs::copy_options::overwrite_existing);
    }
  }
  fs::path description() const { return home_ / "capture/capture.yaml"; }

 private:
  PushedCapture() {
    std::string scene = content_of(small_scene);
    scene.resize(scene.find("\npatterns:"));
    scene += R"(
patterns:
  orientations:
    - {angle_deg: 0, stripe_width_px: 4, bits: 7}
    - {angle_deg: 90, stripe_width_px: 4, bits: 6}
frames: [white, black, {stripes: 0}, {stripes: 1}]
stations:
  - {id: board, board: {position_mm: [0, 0, 500], rotation_deg: [20, 12, 0]}}
  - {id: board_04, board: {position_mm: [0.32, -0.24, 500], rotation_deg: [20, 12, 0]}}
  - {id: board_10, board: {position_mm: [0.8, -0.6, 500], rotation_deg: [20, 12, 0]}}
  - {id: board_30, board: {position_mm: [2.4, -1.8, 500], rotation_deg: [20, 12, 0]}}
  - {id: board_100, board: {position_mm: [8, -6, 500], rotation_deg: [20, 12, 0]}}
  - {id: panel, panel: {position_mm: [0, 0, 500], rotation_deg: [3, 10, 0]}}
  - {id: panel_10, panel: {position_mm: [0.8, -0.6, 500], rotation_deg: [3, 10, 0]}}
)";
    write_content(home_ / "scene.yaml", scene);
    const ProgramRun run = run_program(fmt::format("simulate '{}' --nodepth_maps --out='{}'",
                                                   (home_ / "scene.yaml").string(), (home_ / "capture").string()));
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }

  TemporaryFolder home_;
};

ProgramRun checked(const fs::path& description) { return run_program("check '" + description.string() + "' --json"); }

TEST(CheckMotion, NothingMovedInASoundCapture) {
  const ProgramRun run = checked(PushedCapture::get().description());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(Not(HasSubstr("moved")), Not(HasSubstr("crept"))));
}

struct Push {
  const char* station;
  const char* pushed;
  int from;  // the first frame after it
  const char* severity;
  int exit_code;
  std::vector<std::string> words;
};

class CheckPush : public testing::TestWithParam<Push> {};

TEST_P(CheckPush, IsNamedWithItsStationAndFrames) {
  const Push& push = GetParam();
  const TemporaryFolder home;
  PushedCapture::get().copy_to(home / "capture", push.station, push.pushed, push.from);
  const ProgramRun run = checked(home / "capture/capture.yaml");
  EXPECT_EQ(run.exit_code, push.exit_code) << run.out << run.err;
  const json document = json::parse(run.out);
  ASSERT_EQ(document["findings"].size(), 1U) << document["findings"];
  const json& finding = document["findings"][0];
  EXPECT_EQ(finding["severity"], push.severity);
  EXPECT_EQ(finding["where"], std::string("station ") + push.station + ", camera cam0");
  for (const std::string& words : push.words) {
    EXPECT_THAT(finding["sentence"].get<std::string>(), HasSubstr(words));
  }
}

const std::string kMoved = "the rig or the object moved by about ";

// The camera sees 0.88 px of a millimetre at 500 mm; of a panel's shift only the part across its edges shows.
INSTANTIATE_TEST_SUITE_P(
    BetweenPairs, CheckPush,
    testing::Values(Push{"board", "board_04", 16, "warning", 0, {kMoved, "px between 014.png and 017.png"}},
                    Push{"board", "board_10", 16, "error", 3, {kMoved, "px between 014.png and 017.png"}},
                    Push{"panel", "panel_10", 16, "warning", 0, {kMoved, "px between 014.png and 017.png"}},
                    Push{"board", "board_10", 4, "error", 3, {kMoved, "px between 002.png and 005.png: take"}}));

// The pair's own sum is off by less than the push from either neighbour, by too little for an error.
INSTANTIATE_TEST_SUITE_P(
    InsideAPair, CheckPush,
    testing::Values(Push{"board",
                         "board_10",
                         5,
                         "error",
                         3,
                         {kMoved, "px between 002.png and 007.png, in one push between 004.png and 005.png"}},
                    Push{"board",
                         "board_04",
                         9,
                         "warning",
                         0,
                         {kMoved, "px between 006.png and 011.png, in one push between 008.png and 009.png"}},
                    Push{"board",
                         "board_10",
                         9,
                         "error",
                         3,
                         {kMoved, "px between 006.png and 011.png, in one push between 008.png and 009.png"}},
                    Push{"board",
                         "board_10",
                         17,
                         "error",
                         3,
                         {kMoved, "px between 014.png and 019.png, in one push between 016.png and 017.png"}}));

INSTANTIATE_TEST_SUITE_P(
    BeforeTheStripes, CheckPush,
    testing::Values(Push{"board", "board_10", 1, "error", 3, {kMoved, "px between 000.png and 003.png: take"}},
                    Push{"board", "board_04", 2, "warning", 0, {kMoved, "px between 000.png and 003.png: its points"}},
                    Push{"board", "board_10", 2, "error", 3, {kMoved, "px between 000.png and 003.png: take"}},
                    Push{"panel", "panel_10", 2, "warning", 0, {kMoved, "px between 000.png and 003.png"}}));

// Nothing was taken before the first pair to compare it with, and a shift of many pixels is not found.
INSTANTIATE_TEST_SUITE_P(
    ThatCannotBeTold, CheckPush,
    testing::Values(Push{"board",
                         "board_30",
                         2,
                         "error",
                         3,
                         {"either " + kMoved, "px between 000.png and 003.png, or 000.png (white) shows something else",
                          ": take the station again"}},
                    Push{"board",
                         "board_100",
                         2,
                         "error",
                         3,
                         {"000.png (white) does not show what it should: either another image stands there, or the rig "
                          "or the object moved",
                          "; take the station again"}},
                    Push{"board",
                         "board_100",
                         9,
                         "error",
                         3,
                         {"either they are others or in another order, or the rig or the object moved",
                          "where they agree take the station again"}},
                    Push{
                        "board",
                        "board_100",
                        27,
                        "error",
                        3,
                        {"027.png (the inverse of bit 5 of orientation 1) does not show what it should: either another "
                         "image stands there, or the rig or the object moved"}}));

}  // namespace
}  // namespace crumple
