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

class CheckBag : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(bag() / "data");
    write_capture(bag() / "data");
    replace_in(bag() / "data/capture.yaml", "capture/1\n", "capture/2\noperator: A. N. Other\ndate: 2024-05-03\n");
  }

  std::filesystem::path bag() const { return home_ / "campaign"; }
  ProgramRun check_in(const std::string& folder, const std::string& flags) const {
    return run_program("check '" + (home_ / folder).string() + "' " + flags, "SOURCE_DATE_EPOCH=86400");
  }

  TemporaryFolder home_;
};

TEST_F(CheckBag, ACaptureBecomesOne) {
  const ProgramRun run = check_in("campaign/data/capture.yaml", "--bag");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("written to " + bag().string() + ", which is a bag now: bag-info.txt, bagit.txt"));
  EXPECT_THAT(content_of(bag() / "bag-info.txt"),
              HasSubstr("Bagging-Date: 1970-01-02\nExternal-Description: Two views\n"
                        "Capture-Operator: A. N. Other\nCapture-Date: 2024-05-03\nPayload-Oxum: "));
  EXPECT_THAT(content_of(bag() / "manifest-sha256.txt"), HasSubstr("  data/b.png\n"));
  const json checked = json::parse(check_in("campaign", "--json").out);
  EXPECT_TRUE(checked["bag"]);
  EXPECT_EQ(checked["errors"], 0);
}

TEST_F(CheckBag, TagsStayUnlessTheyMayBeReplaced) {
  ASSERT_EQ(check_in("campaign", "--bag").exit_code, 0);
  replace_in(bag() / "data/capture.yaml", "Two views", "Both views");
  const std::string info = content_of(bag() / "bag-info.txt");
  const ProgramRun again = check_in("campaign", "--bag");
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_THAT(again.err, HasSubstr("--overwrite"));
  EXPECT_EQ(content_of(bag() / "bag-info.txt"), info);
  EXPECT_EQ(check_in("campaign", "").exit_code, 3);
  const ProgramRun anew = check_in("campaign", "--bag --overwrite --json");
  ASSERT_EQ(anew.exit_code, 0) << anew.out << anew.err;
  const json document = json::parse(anew.out);
  EXPECT_THAT(document["findings"][0]["sentence"].get<std::string>(), HasSubstr("was changed"));
  EXPECT_EQ(document["findings"][0]["severity"], "warning");
  EXPECT_EQ(document["written"].size(), 4U);
  EXPECT_THAT(content_of(bag() / "bag-info.txt"), HasSubstr("Both views"));
  EXPECT_EQ(check_in("campaign", "").exit_code, 0);
}

TEST_F(CheckBag, ErrorsComeFirst) {
  std::filesystem::remove(bag() / "data/b.png");
  const ProgramRun run = check_in("campaign", "--bag");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, HasSubstr("no bag is made"));
  EXPECT_FALSE(std::filesystem::exists(bag() / "bagit.txt"));
}

TEST_F(CheckBag, WhatIsNoPayloadIsNeitherMovedNorBagged) {
  std::filesystem::rename(bag() / "data", home_ / "photos");
  const ProgramRun elsewhere = check_in("photos/capture.yaml", "--bag");
  EXPECT_EQ(elsewhere.exit_code, 3);
  EXPECT_THAT(elsewhere.err, HasSubstr("does not lie in a folder named data"));
  EXPECT_EQ(check_in("photos/capture.yaml", "").exit_code, 0);
  std::filesystem::create_directory(bag() / "data");
  std::filesystem::rename(home_ / "photos/capture.yaml", bag() / "data/capture.yaml");
  const ProgramRun images = check_in("campaign", "--bag --images='" + (home_ / "photos").string() + "'");
  EXPECT_EQ(images.exit_code, 3);
  EXPECT_THAT(images.err, HasSubstr("a bag holds them in"));
  EXPECT_FALSE(std::filesystem::exists(bag() / "bagit.txt"));
  EXPECT_EQ(check_in("campaign", "--overwrite").exit_code, 2);
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
