#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/report_check.h"
#include "tests/cli/simulated_capture.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(CalibrateVerb, ParametersBesideTheTruth) {
  const TemporaryFolder home;
  const std::string capture = (home / "capture").string();
  const ProgramRun rendered =
      run_program("simulate '" + small_scene + "' --stations=board_1,board_2,board_3,board_4 --nodepth_maps --out='" +
                  capture + "'");
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  const std::string calibrate =
      "calibrate '" + capture + "/capture.yaml' --json --out='" + (home / "rig").string() + "'";
  const ProgramRun run = run_program(calibrate + " --truth='" + capture + "/truth'");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;  // four placements are few
  const json truth = json::parse(run.out)["truth"];
  ASSERT_EQ(truth["parameters"].size(), 9U + 9U + 6U);
  const json& focal = truth["parameters"][0];
  EXPECT_EQ(focal["name"], "cam0.fx");
  EXPECT_EQ(focal["truth"], 441.2);
  EXPECT_NEAR(focal["estimate"].get<double>() - 441.2, focal["error"], 1e-9);
  EXPECT_GE(truth["share_within_3_sigma"], 0.7);
  EXPECT_EQ(truth["parameters"].back()["name"], "proj0.translation_z");
  EXPECT_LT(std::abs(truth["parameters"].back()["error"].get<double>()), 3);

  const std::string residuals = content_of(home / "rig/residuals.csv");
  EXPECT_THAT(residuals, testing::StartsWith("placement,camera,sensor,kind,index,x_px,y_px,"));
  EXPECT_THAT(residuals, HasSubstr("\nboard_4,cam0,cam0,corners,0,"));
  EXPECT_THAT(residuals, HasSubstr("\nboard_1,cam0,proj0,stripes,0,"));
  EXPECT_TRUE(std::filesystem::exists(home / "rig/overlays/board_1_cam0.png"));
  EXPECT_EQ(wrong_in_report((home / "rig").string()), "");

  const ProgramRun missing = run_program(calibrate + " --overwrite --truth='" + (home / "none").string() + "'");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("none"));
}

}  // namespace
}  // namespace crumple
