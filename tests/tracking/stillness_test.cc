#include "tracking/stillness.h"

#include <gtest/gtest.h>

#include "tests/tracking/made_station.h"

namespace crumple {
namespace {

TEST(Stillness, NothingMovedIsBelieved) {
  const MadeStation station = make_station({});
  std::mt19937 random(2);
  int moved = 0;
  double chi_square = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Stillness found = stillness({with_noise(station.readings, random), with_noise(station.readings, random),
                                       with_noise(station.readings, random)},
                                      0.05);
    EXPECT_EQ(found.degrees, 2 * 2 * 24);
    moved += !found.still;
    chi_square += found.chi_square / found.degrees;
  }
  EXPECT_NEAR(moved / 400.0, 0.05, 0.03);
  EXPECT_NEAR(chi_square / 400, 1, 0.02);
}

// 0.2 mm sideways at 3 m, three sigmas of a pixel.
TEST(Stillness, AShiftOfThreeSigmasIsSeen) {
  const MadeStation station = make_station({});
  std::mt19937 random(2);
  LedReadings later = with_noise(station.readings, random);
  for (LedReading& reading : later) {
    for (Eigen::Vector2d& pixel : reading.view.pixels) pixel.x() += 0.15;
  }
  const Stillness found = stillness({with_noise(station.readings, random), later});
  EXPECT_FALSE(found.still);
  EXPECT_LT(found.probability, 1e-4);
  EXPECT_GT(found.largest_px, 0.1);
  EXPECT_GT(found.rms_px, 0.03);
}

TEST(Stillness, NothingToCompareIsNoEvidence) {
  const MadeStation station = make_station({});
  const Stillness found = stillness({station.readings});
  EXPECT_TRUE(found.still);
  EXPECT_EQ(found.degrees, 0);
  EXPECT_EQ(found.probability, 1);
  EXPECT_TRUE(found.leds.empty());
}

}  // namespace
}  // namespace crumple
