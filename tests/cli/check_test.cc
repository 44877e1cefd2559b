#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// Two views of a grey wedge by one camera; enough for a check.
void write_capture(const std::filesystem::path& folder) {
  write_content(folder / "capture.yaml",
                "schema: crumple-capture/1\ntitle: Two views\n"
                "sensors:\n  cam: {kind: camera, size_px: [80, 60], files: \"{station}.png\"}\n"
                "board: {kind: chessboard, inner_corners: [9, 6], pitch_mm: 25}\n"
                "frames: [ambient]\nstations: [a, b]\n");
  for (const char* const station : {"a", "b"}) {
    cv::Mat image(60, 80, CV_8UC1);
    for (int x = 0; x < image.cols; ++x) image.col(x).setTo(2 * x + *station % 7);
    cv::imwrite((folder / (std::string(station) + ".png")).string(), image);
  }
}

ProgramRun check(const std::filesystem::path& folder, const std::string& flags = "") {
  return run_program("check '" + (folder / "capture.yaml").string() + "' " + flags);
}

TEST(CheckVerb, ASoundCapture) {
  const TemporaryFolder home;
  write_capture(home.path());
  const ProgramRun run = check(home.path());
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 stations, errors: 0"));
}

TEST(CheckVerb, AMissingImageIsNamedOnStdout) {
  const TemporaryFolder home;
  write_capture(home.path());
  std::filesystem::remove(home / "b.png");
  const ProgramRun text = check(home.path());
  EXPECT_EQ(text.exit_code, 3);
  EXPECT_EQ(text.err, "");
  EXPECT_THAT(text.out, HasSubstr("b.png"));
  const json document = json::parse(check(home.path(), "--json").out);
  EXPECT_EQ(document["errors"], 1);
  EXPECT_EQ(document["findings"].back()["severity"], "error");
}

TEST(CheckVerb, ImagesMayLieElsewhere) {
  const TemporaryFolder home;
  write_capture(home.path());
  std::filesystem::create_directory(home / "photos");
  for (const char* const name : {"a.png", "b.png"}) std::filesystem::rename(home / name, home.path() / "photos" / name);
  EXPECT_EQ(check(home.path()).exit_code, 3);
  EXPECT_EQ(check(home.path(), "--images='" + (home / "photos").string() + "'").exit_code, 0);
}

TEST(CheckVerb, InTheFolderOneStandsIn) {
  const TemporaryFolder home;
  write_capture(home.path());
  const ProgramRun run = run_program("check capture.yaml", "cd '" + home.path().string() + "' &&");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
}

TEST(CheckVerb, ABadDescriptionIsAnError) {
  const TemporaryFolder home;
  write_content(home / "capture.yaml", "schema: crumple-capture/1\nsensor: {}\n");
  const ProgramRun run = check(home.path());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("capture.yaml:2:1"));
  EXPECT_EQ(check(home / "none").exit_code, 3);
  EXPECT_EQ(run_program("check").exit_code, 2);
}

}  // namespace
}  // namespace crumple
