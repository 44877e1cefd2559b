// Two cameras, a thermal camera and two projectors on one probe, from images to one refinement and one cloud.
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

const std::string kScene = CRUMPLE_SOURCE_DIR "/tests/data/scenes/several_sensors.yaml";

void simulate(const std::string& scene, const std::string& stations, const std::string& folder) {
  const ProgramRun run =
      run_program("simulate '" + scene + "' --stations=" + stations + " --nodepth_maps --out='" + folder + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err;
}

// One capture of two: at the stations of `b` it is the second projector that shows the patterns.
void join(const TemporaryFolder& home) {
  const std::string a = content_of(home / "a/capture.yaml");
  std::string joined = a.substr(0, a.find("stations:"));
  joined += "stations:\n  - {id: panel_1, name_in_files: a/panel_1, board: false}\n";
  for (const char* const n : {"1", "2", "3"}) {
    joined += std::string("  - {id: a") + n + ", name_in_files: a/board_" + n + "}\n";
  }
  for (const char* const n : {"1", "2"}) {
    joined += std::string("  - {id: b") + n + ", name_in_files: b/board_" + n + ", projector: proj1}\n";
  }
  write_content(home / "capture.yaml", joined);
}

TEST(SeveralSensors, AreCalibratedTogetherAndTheThermalImageIsMapped) {
  const TemporaryFolder home;
  simulate(kScene, "board_1,board_2,board_3,panel_1", (home / "a").string());
  std::string other = content_of(kScene);
  other.replace(other.find("projector: proj0"), 16, "projector: proj1");
  write_content(home / "b.yaml", other);
  simulate((home / "b.yaml").string(), "board_1,board_2", (home / "b").string());
  if (HasFatalFailure()) return;
  join(home);
  const std::string capture = " '" + (home / "capture.yaml").string() + "' --json ";
  const std::string truth = " --truth='" + (home / "a/truth").string() + "'";

  const ProgramRun calibrated =
      run_program("calibrate" + capture + truth + " --nooverlays --noreport --out='" + (home / "rig").string() + "'");
  ASSERT_THAT(calibrated.exit_code, testing::AnyOf(0, 4)) << calibrated.err;  // five placements are few
  const json summary = json::parse(calibrated.out);
  std::set<std::string> seen;
  for (const json& view : summary["views"]) {
    seen.insert(view["sensor"].get<std::string>() + "." + view["kind"].get<std::string>());
  }
  EXPECT_THAT(
      seen, UnorderedElementsAre("cam0.corners", "cam1.corners", "thermal0.corners", "proj0.stripes", "proj1.stripes"));
  // Five lenses of nine parameters and four mounts of six.
  ASSERT_EQ(summary["truth"]["parameters"].size(), 69U);
  EXPECT_GE(summary["truth"]["share_within_3_sigma"], 0.95);

  const ProgramRun reconstructed = run_program("reconstruct" + capture + truth + " --rig='" + (home / "rig").string() +
                                               "' --stations=panel_1 --out='" + (home / "cloud").string() + "'");
  ASSERT_EQ(reconstructed.exit_code, 0) << reconstructed.err;
  const json cloud = json::parse(reconstructed.out);
  EXPECT_EQ(cloud["stations"].size(), 2U);  // one view of each camera
  const std::string ply = content_of(home / "cloud/cloud.ply");
  EXPECT_THAT(ply.substr(0, 1000), HasSubstr("property float thermal0\nproperty float thermal0_views\n"));
}

}  // namespace
}  // namespace crumple
