#include "tracking/stillness.h"

#include <gmock/gmock.h>
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
  EXPECT_TRUE(found.tested());
  EXPECT_THAT(moved_text(found), testing::HasSubstr("moved by up to 0."));
}

Stillness compared(double chi_square, int degrees) {
  Stillness result;
  result.chi_square = chi_square;
  result.degrees = degrees;
  return result;
}

// Readings that differ by five times the variance at every station, and at one station by a hundred times.
TEST(Stillness, WhatAllStationsShowIsNoMotion) {
  const Stillness usual = compared(100, 20), moved = compared(2000, 20), untested = compared(0, 0);
  EXPECT_THAT(moved_stations({usual, untested, usual, moved, usual, usual}), testing::ElementsAre(3));
  EXPECT_THAT(moved_stations({usual, moved}), testing::ElementsAre(1));
  EXPECT_THAT(moved_stations({usual, usual, usual}), testing::IsEmpty());
  EXPECT_THAT(moved_stations({untested, untested}), testing::IsEmpty());
}

// Where covariances hold, and where there is nothing to compare with, less is enough.
TEST(Stillness, StationsThatAreStillHoldTheOthersToTheirCovariances) {
  const Stillness still = compared(14, 20), moved = compared(100, 20);
  EXPECT_THAT(moved_stations({still, moved, still}), testing::ElementsAre(1));
  EXPECT_THAT(moved_stations({moved}), testing::ElementsAre(0));
  EXPECT_THAT(moved_stations({still}), testing::IsEmpty());
}

TEST(Stillness, NothingToCompareIsNoEvidence) {
  const MadeStation station = make_station({});
  const Stillness found = stillness({station.readings});
  EXPECT_TRUE(found.still);
  EXPECT_FALSE(found.tested());
  EXPECT_EQ(found.degrees, 0);
  EXPECT_EQ(found.probability, 1);
  EXPECT_TRUE(found.leds.empty());
}

}  // namespace
}  // namespace crumple
