// Maps of a report against the projection uncertainty itself.
#include "calib/sensor_uncertainty.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "solvers/projection_uncertainty.h"
#include "tests/calib/made_system_data.h"

namespace crumple {
namespace {

TEST(SensorUncertaintyMaps, AreTheProjectionUncertaintyAtEachDistance) {
  const MadeSystem made = make_system({.leds = 4, .stations = 6, .tracker_placements = 5});
  const Calibration calibration{.start = made.truth, .bundle = refine(made.truth, made.observations, {}).value()};
  const Rig rig = calibrated_rig(calibration);
  std::vector<ImageCells> cells;
  for (const Sensor& sensor : rig.sensors) cells.push_back(image_cells({}, sensor.lens.size()));
  const std::vector<double> distances_mm{500, std::numeric_limits<double>::infinity(), 2000};
  const auto maps = sensor_uncertainty_maps(calibration, cells, distances_mm);
  ASSERT_EQ(maps.size(), rig.sensors.size());
  for (std::size_t s = 0; s < maps.size(); ++s) {
    const auto uncertainty = ProjectionUncertainty::create(rig, s);
    ASSERT_TRUE(uncertainty) << uncertainty.error().message;
    ASSERT_EQ(maps[s].size(), distances_mm.size());
    for (std::size_t d = 0; d < distances_mm.size(); ++d) {
      EXPECT_EQ(maps[s][d].distance_mm, distances_mm[d]);
      ASSERT_EQ(maps[s][d].sigma_px.size(), cells[s].cells.size());
      for (std::size_t cell = 0; cell < cells[s].cells.size(); ++cell) {
        const auto covariance = uncertainty->at_pixel(cells[s].centre_px(cell), distances_mm[d]);
        ASSERT_TRUE(covariance && maps[s][d].sigma_px[cell]);
        EXPECT_EQ(*maps[s][d].sigma_px[cell], worst_direction_sigma(*covariance));
      }
    }
    // A map at another distance is another map.
    const std::size_t middle = cells[s].cells.size() / 2;
    EXPECT_GT(std::abs(*maps[s][0].sigma_px[middle] / *maps[s][2].sigma_px[middle] - 1), 0.01) << rig.sensors[s].name;
  }
}

}  // namespace
}  // namespace crumple
