// What calibrate says beside the calibration: the views to take next, and maps of the projection uncertainty.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "calib/image_cells.h"
#include "datasets/rig_file.h"
#include "solvers/projection_uncertainty.h"
#include "tests/cli/simulated_capture.h"
#include "tests/cli/tracked_system.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// At the distance at which the map says it is; infinitely far where that is null.
void expect_map_of(const json& map, double distance_mm, const Rig& rig, std::size_t sensor) {
  SCOPED_TRACE(rig.sensors[sensor].name + " at " + map["distance_mm"].dump());
  if (std::isfinite(distance_mm)) {
    EXPECT_EQ(map["distance_mm"], distance_mm);
  } else {
    EXPECT_TRUE(map["distance_mm"].is_null());
  }
  const auto uncertainty = ProjectionUncertainty::create(rig, sensor);
  ASSERT_TRUE(uncertainty) << uncertainty.error().message;
  const ImageCells cells = image_cells({}, rig.sensors[sensor].lens.size());
  ASSERT_EQ(map["sigma_px"].size(), cells.cells.size());
  for (std::size_t cell = 0; cell < cells.cells.size(); ++cell) {
    const auto covariance = uncertainty->at_pixel(cells.centre_px(cell), distance_mm);
    ASSERT_EQ(map["sigma_px"][cell].is_null(), !covariance);
    if (!covariance) continue;
    EXPECT_NEAR(map["sigma_px"][cell].get<double>() / worst_direction_sigma(*covariance), 1, 1e-6);
  }
}

TEST(CalibrateVerb, NamesTheNextViewsAndMapsWhatIsKnown) {
  const TemporaryFolder home;
  const std::string capture = (home / "capture").string();
  const ProgramRun rendered =
      run_program("simulate '" + small_scene + "' --stations=board_1,board_2,board_3,board_4 --nodepth_maps --out='" +
                  capture + "'");
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  const std::string calibrate = "calibrate '" + capture + "/capture.yaml' --nooverlays --suggest=2 --out='";
  const ProgramRun run = run_program(calibrate + (home / "rig").string() + "' --map_distances_mm=300,inf,1500 --json");
  ASSERT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;  // four placements are few
  const json summary = json::parse(content_of(home / "rig/summary.json"));
  const json& next = summary["next_views"];
  EXPECT_EQ(next["quantity"], "point_mm");
  ASSERT_EQ(next["views"].size(), 2U);
  double before = next["now"];
  EXPECT_GT(before, 0);
  for (const json& view : next["views"]) {
    EXPECT_EQ(view["camera"], "cam0");
    EXPECT_EQ(view["board"], "board");
    EXPECT_GT(view["distance_mm"], 0);
    EXPECT_EQ(view["before"], before);
    EXPECT_LT(view["after"], before);
    before = view["after"];
  }

  const Rig rig = read_rig(home / "rig").value();
  const double distances_mm[] = {300, std::numeric_limits<double>::infinity(), 1500};
  const std::string report = content_of(home / "rig/report.html");
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const json& maps = summary["projection_uncertainty_maps"][rig.sensors[s].name];
    ASSERT_EQ(maps.size(), 3U);
    for (std::size_t d = 0; d < 3; ++d) expect_map_of(maps[d], distances_mm[d], rig, s);
  }
  EXPECT_THAT(report, HasSubstr("that lies infinitely far away"));
  EXPECT_THAT(report, HasSubstr(">1500</data> mm away"));

  const ProgramRun text = run_program(calibrate + (home / "again").string() + "' --noreport --map_distances_mm=300");
  ASSERT_EQ(text.exit_code, run.exit_code) << text.err;
  for (const json& view : next["views"]) {
    EXPECT_THAT(text.out, testing::ContainsRegex(view["words"].get<std::string>() +
                                                 ": lowers the mean uncertainty in the measuring volume from "
                                                 "[0-9.]+ to [0-9.]+ mm\n"));
    EXPECT_THAT(view["words"].get<std::string>(), HasSubstr(" mm before cam0, "));
  }
  EXPECT_THAT(text.out, testing::ContainsRegex("projection uncertainty of proj0 at 300 mm: [0-9.]+ to [0-9.]+ px"));
}

// Before anything is read: the capture need not exist.
TEST(CalibrateMaps, ADistanceThatIsNoneIsRefused) {
  for (const char* const distances : {"0", "-500", "500,0.1", "1e12", "nan", "-inf", "near"}) {
    const TemporaryFolder home;
    const ProgramRun run = run_program(std::string("calibrate none.yaml --map_distances_mm=") + distances + " --out='" +
                                       (home / "rig").string() + "'");
    EXPECT_EQ(run.exit_code, 2) << distances;
    EXPECT_THAT(run.err, HasSubstr("--map_distances_mm")) << distances;
    EXPECT_EQ(home.entries(), 0);
  }
}

// Of LEDs alone there is no volume to plan for: that is said, and the calibration is written all the same.
TEST(TrackedSystemVerbs, CalibrateIsNotLostWhereNothingCanBeSuggested) {
  const TrackedSystem& system = TrackedSystem::get();
  std::string stations;
  for (const char* const id : {"cal_01", "cal_05", "cal_06", "wand_1"}) {
    stations += std::string("  - {id: ") + id + ", board: false, scan: false}\n";
  }
  const TemporaryFolder home;
  const ProgramRun run =
      run_program("calibrate '" + system.with_stations("wand.yaml", stations) + "' --start='" + system.rig() +
                  "' --suggest=1 --nooverlays --noreport --json --out='" + (home / "rig").string() + "'");
  EXPECT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  ASSERT_TRUE(std::filesystem::exists(home / "rig/rig.yaml")) << run.err;
  const json next = json::parse(content_of(home / "rig/summary.json"))["next_views"];
  EXPECT_THAT(next["not_done"].get<std::string>(), HasSubstr("no camera sees a board"));
  EXPECT_FALSE(next.contains("views"));
}

}  // namespace
}  // namespace crumple
