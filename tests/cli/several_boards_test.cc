// Two boards in one image, through the program. A scene holds one board, so images are put together: the left half is
// of one rendering, the right half of another by the same camera.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/placements_file.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

const std::string kBoardsScene = CRUMPLE_SOURCE_DIR "/tests/data/scenes/several_boards.yaml";
const std::string kTags = "kind: charuco, inner_corners: [4, 6], pitch_mm: 32, marker_mm: 24, dictionary: 4X4_100";
const std::string kOtherTags = kTags + ", first_id: 40";
const std::string kSquares = "inner_corners: [5, 8], pitch_mm: 27";

// Rendered once for all tests of a program run.
class BoardPairs {
 public:
  static const BoardPairs& get() {
    static const BoardPairs pairs;
    return pairs;
  }

  fs::path truth() const { return home_ / "tags/truth"; }
  // Runs a verb on images that show boards of both descriptions: NAME.png for each name of `stations`, which are lines
  // of the capture's description.
  ProgramRun run(const std::string& verb, const std::string& boards, const std::string& stations) const {
    const fs::path file = home_ / "capture.yaml";
    write_content(file,
                  "schema: crumple-capture/2\ntitle: Two boards at once\nsensors:\n"
                  "  cam0: {kind: camera, size_px: [640, 480], files: \"{station}.png\"}\n"
                  "frames: [ambient]\nboards:\n" +
                      boards + "stations:\n" + stations);
    return run_program(fmt::format("{} '{}' --json", verb, file.string()));
  }

 private:
  BoardPairs() {
    render("tags", kTags, "left_1,left_2,left_3,left_4");
    render("squares", kSquares, "right_1,right_2,right_3,right_4,right_part");
    render("other", kOtherTags, "right_1,right_2");
    for (const char* const n : {"1", "2", "3", "4"})
      join(std::string("left_") + n, std::string("squares/right_") + n, n);
    join("left_2", "squares/right_part", "part");
    for (const char* const n : {"1", "2"}) {
      join(std::string("left_") + n, std::string("other/right_") + n, std::string("other_") + n);
    }
  }

  void render(const std::string& name, const std::string& board, const std::string& stations) const {
    const fs::path scene = home_ / (name + ".yaml");
    fs::copy(kBoardsScene, scene);
    replace_in(scene, kTags, board);
    const ProgramRun run = run_program(fmt::format("simulate '{}' --stations={} --nodepth_maps --out='{}'",
                                                   scene.string(), stations, (home_ / name).string()));
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }

  void join(const std::string& left, const std::string& right, const std::string& name) const {
    const auto read = [&](const std::string& station) {
      return cv::imread((home_ / station / "cam0/000.png").string(), cv::IMREAD_UNCHANGED);
    };
    cv::Mat image = read("tags/" + left);
    const cv::Rect half(image.cols / 2, 0, image.cols - image.cols / 2, image.rows);
    read(right)(half).copyTo(image(half));
    EXPECT_TRUE(cv::imwrite((home_ / (name + ".png")).string(), image));
  }

  TemporaryFolder home_;
};

const std::string kThreeBoards =
    "  tags: {" + kTags + "}\n  squares: {" + kSquares + "}\n  other: {" + kOtherTags + "}\n";
const std::string kStations =
    "  - {id: \"1\", boards: [tags, squares]}\n  - {id: \"2\", boards: [tags, squares]}\n"
    "  - {id: \"3\", boards: [tags, squares]}\n  - {id: \"4\", boards: [tags, squares]}\n"
    "  - {id: other_1, boards: [tags, other]}\n  - {id: other_2, boards: [tags, other]}\n";

// The middle of a board as tests/data/scenes/several_boards.yaml has it.
const std::map<std::string, Eigen::Vector3d> kMiddles_mm{
    {"1/tags", {-120, 0, 620}},       {"1/squares", {120, 0, 640}},      {"2/tags", {-125, 10, 640}},
    {"2/squares", {125, -10, 620}},   {"3/tags", {-115, -10, 600}},      {"3/squares", {120, 8, 650}},
    {"4/tags", {-120, 0, 660}},       {"4/squares", {125, 0, 600}},      {"other_1/tags", {-120, 0, 620}},
    {"other_1/other", {120, 0, 640}}, {"other_2/tags", {-125, 10, 640}}, {"other_2/other", {125, -10, 620}}};

TEST(SeveralBoards, EachIsUsedWhereItIs) {
  const BoardPairs& pairs = BoardPairs::get();
  const TemporaryFolder home;
  const ProgramRun run = pairs.run(fmt::format("calibrate --nooverlays --noreport --truth='{}' --out='{}'",
                                               pairs.truth().string(), (home / "rig").string()),
                                   kThreeBoards, kStations);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["placements"], kMiddles_mm.size());
  EXPECT_TRUE(summary["skipped"].empty()) << summary["skipped"];
  std::vector<std::string> boards;
  for (const auto& [name, board] : summary["boards"].items()) boards.push_back(name);
  EXPECT_THAT(boards, UnorderedElementsAre("tags", "squares", "other"));
  for (const json& view : summary["views"]) {
    EXPECT_LT(view["rms_px"], 0.15) << view;
    EXPECT_GE(view["observations"], 20) << view;
  }
  EXPECT_GE(summary["truth"]["share_within_3_sigma"], 0.95);

  const fs::path file = home / "rig/placements.yaml";
  const auto placed = parse_placements(content_of(file), file.string());
  ASSERT_TRUE(placed) << placed.error().message;
  ASSERT_EQ(placed->placements.size(), kMiddles_mm.size());
  for (const BoardPlacement& placement : placed->placements) {
    ASSERT_TRUE(kMiddles_mm.contains(placement.name)) << placement.name;
    const Target& target = placed->boards[placement.board].target;
    EXPECT_EQ(placement.name.substr(placement.name.find('/') + 1), placed->boards[placement.board].name);
    const Eigen::Vector3d middle(0.5 * (target.columns - 1) * target.pitch_mm,
                                 0.5 * (target.rows - 1) * target.pitch_mm, 0);
    const Eigen::Vector3d off = placement.world_from_board * middle - kMiddles_mm.at(placement.name);
    // A principal point that is off by 4 px moves all boards by as much of 640 mm over 700 px.
    EXPECT_LT(off.norm(), 5) << placement.name;
  }
}

// Beside another board, what is seen of a chessboard's part could be that one's; alone it is used. A check says the
// same.
TEST(SeveralBoards, APartWithoutMarkersIsLeftOutBesideAnother) {
  const BoardPairs& pairs = BoardPairs::get();
  const TemporaryFolder home;
  const auto calibrate = [&](const std::string& in_view, const std::string& out) {
    const ProgramRun run = pairs.run(fmt::format("calibrate --nooverlays --noreport --out='{}'", (home / out).string()),
                                     kThreeBoards, kStations + "  - {id: part, boards: [" + in_view + "]}\n");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return json::parse(run.out);
  };
  // What a check says of views that it would not use.
  const auto left_out = [&](const std::string& in_view) {
    const ProgramRun run = pairs.run("check", kThreeBoards, kStations + "  - {id: part, boards: [" + in_view + "]}\n");
    const json report = json::parse(run.out);
    std::vector<std::string> all;
    for (const json& finding : report["findings"]) {
      const auto text = [&](const char* key) { return finding[key].get<std::string>(); };
      if (text("sentence").find("will not be used") == std::string::npos) continue;
      all.push_back(text("severity") + ": " + text("where") + ": " + text("sentence"));
    }
    return all;
  };
  const json beside = calibrate("tags, squares", "beside");
  ASSERT_EQ(beside["skipped"].size(), 1U) << beside["skipped"];
  EXPECT_EQ(beside["skipped"][0]["station"], "part/squares");
  EXPECT_EQ(beside["skipped"][0]["sensor"], "cam0");
  EXPECT_THAT(beside["skipped"][0]["reason"].get<std::string>(), HasSubstr("could be part of another board"));
  EXPECT_EQ(beside["placements"], kMiddles_mm.size() + 1);  // that of the board with markers
  EXPECT_THAT(
      left_out("tags, squares"),
      ElementsAre("warning: station part, camera cam0, squares: the board's view in part.png will not be used: " +
                  beside["skipped"][0]["reason"].get<std::string>() + "."));
  EXPECT_THAT(left_out("squares"), IsEmpty());
  const json alone = calibrate("squares", "alone");
  EXPECT_TRUE(alone["skipped"].empty()) << alone["skipped"];
  EXPECT_EQ(alone["placements"], kMiddles_mm.size() + 1);
}

TEST(SeveralBoards, TwoThatLookAlikeAreRefusedByName) {
  const BoardPairs& pairs = BoardPairs::get();
  const TemporaryFolder home;
  const std::string calibrate = fmt::format("calibrate --out='{}'", (home / "rig").string());
  const std::string twins = "  one: {" + kSquares + "}\n  two: {inner_corners: [8, 5], pitch_mm: 25}\n";
  const ProgramRun squares = pairs.run(calibrate, twins, "  - \"1\"\n  - {id: \"2\", boards: [two]}\n");
  EXPECT_EQ(squares.exit_code, 3) << squares.out;
  EXPECT_THAT(squares.err,
              AllOf(HasSubstr("capture.yaml:10:"), HasSubstr("has boards `one` and `two` in view, which look alike")));
  const ProgramRun tags =
      pairs.run(calibrate, "  one: {" + kTags + "}\n  two: {" + kTags + ", first_id: 16}\n", "  - \"1\"\n");
  EXPECT_EQ(tags.exit_code, 3) << tags.out;
  EXPECT_THAT(tags.err, HasSubstr("has markers in common with `one`"));
  EXPECT_FALSE(fs::exists(home / "rig"));
  // At one station each, nothing can be mistaken.
  const ProgramRun apart =
      pairs.run("check", twins, "  - {id: \"1\", boards: [one]}\n  - {id: \"2\", boards: [two]}\n");
  EXPECT_EQ(apart.exit_code, 0) << apart.out << apart.err;
}

}  // namespace
}  // namespace crumple
