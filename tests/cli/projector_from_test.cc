// A capture that holds stripes and a projected chessboard: the projector from either, and from both together.
#include <cmath>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

std::string replaced(std::string text, const std::string& part, const std::string& by) {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return at == std::string::npos ? text : text.replace(at, part.size(), by);
}

std::set<std::string> kinds_of(const json& summary) {
  std::set<std::string> kinds;
  for (const json& view : summary["views"]) kinds.insert(view["kind"]);
  return kinds;
}

const json& parameter(const json& summary, const std::string& name) {
  for (const json& row : summary["truth"]["parameters"]) {
    if (row["name"] == name) return row;
  }
  throw std::out_of_range(name);
}

TEST(CalibrateVerb, AProjectorFromStripesAProjectedChessboardOrBoth) {
  const TemporaryFolder home;
  std::string scene = content_of(CRUMPLE_SOURCE_DIR "/datasets/scenes/projected_board.yaml");
  scene = replaced(scene, "samples_per_pixel: 16", "samples_per_pixel: 2");
  scene = replaced(scene, "patterns:\n",
                   "patterns:\n  orientations:\n    - {angle_deg: 0, stripe_width_px: 2, bits: 9}\n"
                   "    - {angle_deg: 90, stripe_width_px: 2, bits: 9}\n");
  scene = replaced(scene, "chessboard]", "chessboard, {stripes: 0}, {stripes: 1}]");
  write_content(home / "scene.yaml", scene);
  const std::string capture = (home / "capture").string();
  const ProgramRun rendered =
      run_program("simulate '" + (home / "scene.yaml").string() +
                  "' --stations=board_1,board_2,board_3,board_4 --nodepth_maps --out='" + capture + "'");
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;

  const auto calibrated = [&](const std::string& from) {
    const ProgramRun run =
        run_program("calibrate '" + capture + "/capture.yaml' --json --nooverlays --noreport --overwrite --truth='" +
                    capture + "/truth' --out='" + (home / "rig").string() + "' --projector_from=" + from);
    EXPECT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
    return json::parse(run.out);
  };
  const json stripes = calibrated("stripes"), chessboard = calibrated("chessboard"), both = calibrated("auto");
  EXPECT_THAT(kinds_of(stripes), ElementsAre("corners", "stripes"));
  EXPECT_THAT(kinds_of(chessboard), ElementsAre("corners", "features"));
  EXPECT_THAT(kinds_of(both), ElementsAre("corners", "features", "stripes"));
  for (const json* summary : {&stripes, &chessboard, &both}) {
    for (const char* name : {"proj0.fx", "proj0.cx", "proj0.rotation_y", "proj0.translation_x"}) {
      const json& row = parameter(*summary, name);
      EXPECT_LT(std::abs(row["error"].get<double>()), 4 * row["sigma"].get<double>()) << name;
    }
  }
  // Against the chessboard alone tests/calib/calibrate_test.cc says it exactly: how many observations count as one four
  // placements tell to some 20 % only, each time anew.
  const auto sigma_of_fx = [](const json& summary) { return parameter(summary, "proj0.fx")["sigma"].get<double>(); };
  EXPECT_LT(sigma_of_fx(both), sigma_of_fx(stripes));

  const ProgramRun neither = run_program("calibrate '" + capture + "/capture.yaml' --projector_from=lamp --out=x");
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("projector_from"));
}

}  // namespace
}  // namespace crumple
