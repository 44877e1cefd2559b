#include "datasets/placements_file.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

TEST(PlacementsFile, WhatIsWrittenIsReadBack) {
  Placements all;
  all.boards.push_back({.name = "wall, \"left\"", .target = {9, 6, 25}, .warp_mm = {0.1, -1 / 3.0}, .scale = 1.0002});
  all.placements.push_back({"1", 0, Pose{rotation_from_vector({0.1, 0.3, -0.7}), {1 / 3.0, 2, 1e3}}});
  all.stations.push_back({"door", Pose{rotation_from_vector({2, 0, 0.5}), {0, -1 / 7.0, 5}}});
  const auto read = parse_placements(placements_yaml(all), "placements.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->boards.size(), 1U);
  EXPECT_EQ(read->boards[0].name, all.boards[0].name);
  EXPECT_EQ(read->boards[0].target.pitch_mm, 25);
  EXPECT_EQ(read->boards[0].warp_mm, all.boards[0].warp_mm);
  EXPECT_EQ(read->boards[0].scale, 1.0002);
  ASSERT_EQ(read->placements.size(), 1U);
  EXPECT_EQ(read->placements[0].world_from_board.rotation.coeffs(),
            all.placements[0].world_from_board.rotation.coeffs());
  ASSERT_EQ(read->stations.size(), 1U);
  EXPECT_EQ(read->stations[0].world_from_probe.translation, all.stations[0].world_from_probe.translation);
}

TEST(PlacementsFile, NoPlacementsAreReadBack) {
  const auto read = parse_placements(placements_yaml({}), "placements.yaml");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->boards.empty());
  EXPECT_TRUE(read->placements.empty());
}

}  // namespace
}  // namespace crumple
