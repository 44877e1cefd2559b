#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/cloud_file.h"
#include "tests/cli/simulated_capture.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class ReconstructVerb : public testing::Test {
 protected:
  // With the true rig, unless the flags name another.
  ProgramRun reconstruct(const fs::path& capture, const std::string& flags) const {
    const std::string rig =
        flags.find("--rig=") == std::string::npos ? " --rig='" + (capture / "truth/rig").string() + "'" : "";
    return run_program("reconstruct '" + (capture / "capture.yaml").string() + "'" + rig + " --out='" +
                       (home_ / "out").string() + "' " + flags);
  }

  const fs::path capture_ = SimulatedCapture::get().folder();
  const std::string truth_ = " --truth='" + (capture_ / "truth").string() + "'";
  TemporaryFolder home_;
};

TEST_F(ReconstructVerb, APanelAgainstItsTruth) {
  const ProgramRun run = reconstruct(capture_, "--estimator=weighted,paper" + truth_);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("panel_1, cam0, weighted"));
  EXPECT_THAT(run.out, HasSubstr("orientation 90 deg was left out: its stripes run along the epipolar lines"));
  const json summary = json::parse(content_of(home_ / "out/summary.json"));
  ASSERT_EQ(summary["stations"].size(), 2U);  // one station by two estimators: the board's is not what was measured
  EXPECT_EQ(summary["stations"][0]["id"], "panel_1");
  const double weighted = summary["truth"]["cloud_rms_mm"]["weighted"];
  const double paper = summary["truth"]["cloud_rms_mm"]["paper"];
  EXPECT_LT(weighted, 0.35 * paper);
  EXPECT_GT(weighted, 0);
  const double ratio = summary["truth"]["estimators"]["paper"]["observed_over_predicted"];
  EXPECT_NEAR(ratio, 1, 0.3);

  const auto cloud = read_cloud(home_ / "out/cloud.ply");
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->stations, std::vector<std::string>{"panel_1"});
  EXPECT_EQ(cloud->points.size(), summary["points"]);
  EXPECT_TRUE(fs::exists(home_ / "out/cloud_paper.ply"));
  const cv::Mat picture = cv::imread((home_ / "out/picture.png").string());
  EXPECT_EQ(picture.size(), cv::Size(1600, 1000));
}

TEST_F(ReconstructVerb, AStationThatFailsLeavesTheOthers) {
  const fs::path damaged = home_ / "capture";
  SimulatedCapture::get().copy_to(damaged);
  fs::remove(damaged / "board_1/cam0/007.png");
  const ProgramRun run = reconstruct(damaged, "--stations=board_1,panel_1 --json");
  EXPECT_EQ(run.exit_code, 5);
  const json document = json::parse(run.out);
  ASSERT_EQ(document["failed"].size(), 1U);
  EXPECT_EQ(document["failed"][0]["id"], "board_1");
  EXPECT_THAT(document["failed"][0]["reason"].get<std::string>(), HasSubstr("007.png"));
  EXPECT_GT(document["points"], 1000);
  EXPECT_TRUE(fs::exists(home_ / "out/cloud.ply"));
}

TEST_F(ReconstructVerb, NothingIsWrittenWhereAllStationsFail) {
  const fs::path damaged = home_ / "capture";
  SimulatedCapture::get().copy_to(damaged);
  fs::remove(damaged / "panel_1/cam0/007.png");
  const ProgramRun run = reconstruct(damaged, "");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("007.png"));
  EXPECT_EQ(home_.entries(), 1);
}

TEST_F(ReconstructVerb, Mistakes) {
  const auto expect = [&](const std::string& flags, int exit_code, const std::string& said) {
    const ProgramRun run = reconstruct(capture_, flags);
    EXPECT_EQ(run.exit_code, exit_code) << flags;
    EXPECT_THAT(run.err, HasSubstr(said)) << flags;
    EXPECT_FALSE(fs::exists(home_ / "out")) << flags;
  };
  expect("--estimator=wheighted", 2, "wheighted is none of weighted, paper and edges");
  expect("--estimator=paper,paper", 2, "twice");
  expect("--bit_rule=best", 2, "--bit_rule=best");
  expect("--stations=panel_7", 3, "no station panel_7");
  expect("--rig='" + (home_ / "none").string() + "'", 3, "none");
  expect("--truth='" + (home_ / "none").string() + "'", 3, "none");
}

TEST_F(ReconstructVerb, ARigOfAnotherCamera) {
  const fs::path other = home_ / "other";
  fs::copy(capture_ / "truth/rig", other);
  while (content_of(other / "rig.yaml").find("cam0") != std::string::npos) {
    replace_in(other / "rig.yaml", "cam0", "left");
  }
  fs::rename(other / "cam0.cameramodel", other / "left.cameramodel");
  const ProgramRun unknown = reconstruct(capture_, "--rig='" + other.string() + "'");
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_THAT(unknown.err, HasSubstr("knows none of the capture's cameras"));

  const fs::path larger = home_ / "larger";
  fs::copy(capture_ / "truth/rig", larger);
  replace_in(larger / "rig.yaml", "320, 240", "640, 480");
  replace_in(larger / "cam0.cameramodel", "320", "640");
  replace_in(larger / "cam0.cameramodel", "240", "480");
  const ProgramRun run = reconstruct(capture_, "--rig='" + larger.string() + "'");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("640 x 480"));
}

}  // namespace
}  // namespace crumple
