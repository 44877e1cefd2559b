// datasets/scenes/tracked_small.yaml: what is true of it, and what a cloud of it must keep.
#pragma once

#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.h"

namespace crumple {

inline constexpr double kBar_mm = 600.1127, kBarSigma_mm = 0.02;  // bar_a to bar_b, and as a certificate has it

inline void add_scale_bar(const std::filesystem::path& description) {
  replace_in(description, "\ntracker_frames:",
             fmt::format("\nscale_bars:\n  bar: {{leds: [bar_a, bar_b], length_mm: {}, "
                         "certificate: {{length_sigma_mm: {}}}}}\ntracker_frames:",
                         kBar_mm, kBarSigma_mm));
}

// Standard, of the position of a point in the room: what the cloud says of itself.
inline double stated_mm(const nlohmann::json& cloud) {
  const nlohmann::json& of = cloud["uncertainty"];
  return std::hypot(of["median_calibration_mm"].get<double>(), of["median_station_mm"].get<double>(),
                    of["median_decoding_mm"].get<double>());
}

// What one rigid move of the cloud onto the surface cannot take away: the stations' poses against each other, decoding.
inline double stated_shape_mm(const nlohmann::json& cloud) {
  const nlohmann::json& of = cloud["uncertainty"];
  return std::hypot(of["median_station_mm"].get<double>(), of["median_decoding_mm"].get<double>());
}

// The rig and the stations are common to all points: the whole cloud is off as one sample of its uncertainty is, and 4
// sigmas are exceeded once in 16,000.
inline void expect_as_good_as_stated(const nlohmann::json& cloud) {
  ASSERT_TRUE(cloud["uncertainty"].value("scale_known", false)) << cloud["uncertainty"];
  EXPECT_LE(cloud["truth"]["cloud_raw_rms_mm"]["weighted"].get<double>(), 4 * stated_mm(cloud));
  EXPECT_LE(cloud["truth"]["estimators"]["weighted"]["moved_rms_mm"].get<double>(), 4 * stated_shape_mm(cloud));
}

}  // namespace crumple
