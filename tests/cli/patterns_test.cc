#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/run_record.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string small(const std::filesystem::path& out) {
  return "patterns --width_px=64 --height_px=48 --out='" + out.string() + "' ";
}

TEST(PatternsVerb, WritesImagesDescriptionAndRecord) {
  const TemporaryFolder home;
  const ProgramRun run = run_program(small(home / "out") + "--json --orientations_deg=0,45");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const json document = json::parse(run.out);
  EXPECT_EQ(document["orientations"][1]["bits"], 7);
  for (const json& file : document["files"]) {
    const cv::Mat image = cv::imread((home.path() / "out" / file.get<std::string>()).string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(image.size(), cv::Size(64, 48));
  }
  EXPECT_TRUE(std::filesystem::exists(home / "out/patterns.yaml"));
  const json crate = json::parse(content_of(home / "out/ro-crate-metadata.json"));
  for (const json& node : crate["@graph"]) {
    if (node["@type"] != "File") continue;
    EXPECT_EQ(sha256_of_file(home.path() / "out" / node["@id"].get<std::string>()).value(), node["sha256"]);
  }
}

TEST(PatternsVerb, SameCommandSameBytes) {
  const TemporaryFolder home;
  const std::string before = "cd '" + home.path().string() + "' && SOURCE_DATE_EPOCH=1";
  ASSERT_EQ(run_program("patterns --board --out=a", before).exit_code, 0);
  std::filesystem::rename(home / "a", home / "b");
  ASSERT_EQ(run_program("patterns --board --out=a", before).exit_code, 0);
  EXPECT_EQ(content_of(home / "a/ro-crate-metadata.json"), content_of(home / "b/ro-crate-metadata.json"));
  EXPECT_THAT(content_of(home / "a/ro-crate-metadata.json"), HasSubstr("\"1970-01-01\""));
  EXPECT_EQ(content_of(home / "a/board.pdf"), content_of(home / "b/board.pdf"));
}

TEST(PatternsVerb, AFolderThatExistsIsLeftAlone) {
  const TemporaryFolder home;
  ASSERT_EQ(run_program(small(home / "out")).exit_code, 0);
  write_content(home / "out/note", "mine");
  const ProgramRun refused = run_program(small(home / "out") + "--json");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("exists already"));
  EXPECT_EQ(json::parse(refused.out)["exit_code"], 3);
  EXPECT_EQ(content_of(home / "out/note"), "mine");
  EXPECT_EQ(run_program(small(home / "out") + "--overwrite").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(home / "out/note"));
}

TEST(PatternsVerb, AFullDiskIsASentenceAndLeavesNothing) {
  const TemporaryFolder home;
  const ProgramRun run = run_program(small(home / "out"), "trap '' XFSZ; ulimit -f 0;");
  // The limit hits the shell's own redirections too, so only code and folder can be looked at.
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(home.entries(), 0);
}

TEST(PatternsVerb, AFolderThatCannotBeMadeIsASentence) {
  const ProgramRun run = run_program(small("/proc/none/out"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("/proc/none"));
}

// What it says goes into capture.yaml as it is.
TEST(PatternsVerb, DrawsEveryKindOfBoardAndDescribesIt) {
  const TemporaryFolder home;
  const auto patterns = [&](const std::string& flags) {
    return run_program("patterns --board --overwrite --out='" + (home / "out").string() + "' " + flags);
  };
  const ProgramRun charuco = patterns("--board_kind=charuco");
  EXPECT_EQ(charuco.exit_code, 0) << charuco.err;
  EXPECT_THAT(charuco.out, HasSubstr("board: {kind: charuco, inner_corners: [10, 7], pitch_mm: 20, marker_mm: 15, "
                                     "dictionary: 5X5_250, first_id: 0}"));
  const ProgramRun tags = patterns("--board_kind=apriltag --board_columns=5 --board_rows=4 --board_pitch_mm=40");
  EXPECT_THAT(tags.out, HasSubstr("markers: [5, 4], pitch_mm: 40, marker_mm: 32, dictionary: APRILTAG_36h11"));
  EXPECT_THAT(patterns("--board_kind=dots").out, HasSubstr("dots: [10, 7], pitch_mm: 20, diameter_mm: 10"));
  EXPECT_EQ(patterns("--board_kind=dots --board_mark_mm=19").exit_code, 2);
  EXPECT_THAT(patterns("--board_kind=circles").err, HasSubstr("chessboard, charuco, apriltag and dots"));
}

TEST(PatternsVerb, WarnsOfABoardThatLooksTheSameUpsideDown) {
  const TemporaryFolder home;
  const ProgramRun run = run_program("patterns --board --board_rows=8 --out='" + (home / "out").string() + "'");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("warning: turned by half a turn"));
  EXPECT_TRUE(std::filesystem::exists(home / "out/board.pdf"));
}

TEST(PatternsVerb, LedWordsForTheController) {
  const TemporaryFolder home;
  const std::string out = "--out='" + (home / "leds").string() + "' ";
  const ProgramRun run = run_program("patterns --led --led_count=5 --led_length=16 --json " + out);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(run.out);
  ASSERT_EQ(document["words"].size(), 5u);
  EXPECT_EQ(document["words"][4].size(), 16u);
  EXPECT_GE(document["distance"], 4);
  std::string table = "led";
  for (int frame = 0; frame < 16; ++frame) table += ",frame_" + std::to_string(frame);
  for (std::size_t led = 0; led < 5; ++led) {
    table += "\n" + std::to_string(led);
    for (const json& state : document["words"][led]) table += "," + std::to_string(state.get<int>());
  }
  EXPECT_EQ(content_of(home / "leds/leds.csv"), table + "\n");
  const ProgramRun text = run_program("patterns --led --overwrite " + out);
  EXPECT_THAT(text.out, HasSubstr("8 words of 18 frames; any two differ in 8 frames or more, and in 6 or more"));
}

TEST(PatternsVerb, LedWordsThatCannotBeAreUsageErrors) {
  EXPECT_THAT(run_program("patterns --led --led_count=40 --led_length=12 --out=x").err, HasSubstr("take longer words"));
  EXPECT_EQ(run_program("patterns --led --led_length=40 --out=x").exit_code, 2);
  EXPECT_EQ(run_program("patterns --led --board --out=x").exit_code, 2);
}

}  // namespace
}  // namespace crumple
