// Frames that were taken after the rig or the object was pushed, in captures that the program itself rendered.
#include <filesystem>
#include <string>

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

constexpr int kFrames = 28, kPushedFrom = 16;  // of 28 frames, 002 to 027 are pairs of a pattern and its inverse

// A board and a panel, and the same again where they are after a push. Rendered once for all tests of a program run.
class PushedCapture {
 public:
  static const PushedCapture& get() {
    static const PushedCapture capture;
    return capture;
  }

  // Whose station's frames from kPushedFrom on are those of the other.
  void copy_to(const fs::path& folder, const std::string& station, const std::string& pushed) const {
    fs::copy(home_ / "capture", folder, fs::copy_options::recursive);
    for (int frame = kPushedFrom; frame < kFrames; ++frame) {
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

ProgramRun check(const fs::path& description) { return run_program("check '" + description.string() + "' --json"); }

TEST(CheckMotion, NothingMovedInASoundCapture) {
  const ProgramRun run = check(PushedCapture::get().description());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(Not(HasSubstr("moved")), Not(HasSubstr("crept"))));
}

struct Push {
  const char* station;
  const char* pushed;
  const char* severity;
  int exit_code;
};

class CheckPush : public testing::TestWithParam<Push> {};

TEST_P(CheckPush, IsNamedWithItsStationAndFrames) {
  const Push& push = GetParam();
  const TemporaryFolder home;
  PushedCapture::get().copy_to(home / "capture", push.station, push.pushed);
  const ProgramRun run = check(home / "capture/capture.yaml");
  EXPECT_EQ(run.exit_code, push.exit_code) << run.out << run.err;
  const json document = json::parse(run.out);
  ASSERT_EQ(document["findings"].size(), 1U) << document["findings"];
  const json& finding = document["findings"][0];
  EXPECT_EQ(finding["severity"], push.severity);
  EXPECT_EQ(finding["where"], std::string("station ") + push.station + ", camera cam0");
  EXPECT_THAT(finding["sentence"].get<std::string>(),
              AllOf(HasSubstr("the rig or the object moved by about "), HasSubstr("px between 014.png and 017.png")));
}

// The camera sees 0.88 px of a millimetre at 500 mm; of a panel's shift only the part across its edges shows.
INSTANTIATE_TEST_SUITE_P(Pushes, CheckPush,
                         testing::Values(Push{"board", "board_04", "warning", 0}, Push{"board", "board_10", "error", 3},
                                         Push{"panel", "panel_10", "warning", 0}));

}  // namespace
}  // namespace crumple
