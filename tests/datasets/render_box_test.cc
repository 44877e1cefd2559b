#include <gtest/gtest.h>

#include "datasets/render/box.h"

namespace crumple {
namespace {

const Box box{Pose{rotation_from_vector({0, 0, M_PI / 4}), {10, 0, 0}}, {2, 2, 4}};

TEST(Box, hides_what_lies_behind_it_only) {
  EXPECT_TRUE(stands_between(box, {10, 0, -10}, {10, 0, 10}));
  EXPECT_FALSE(stands_between(box, {10, 0, -10}, {10, 0, -3}));
  EXPECT_TRUE(stands_between(box, {10, 0, -10}, {10, 0, 0}));
  // Turned by 45 deg, its corner reaches out to sqrt(2).
  EXPECT_TRUE(stands_between(box, {11.4, 0, -10}, {11.4, 0, 10}));
  EXPECT_FALSE(stands_between(box, {11.42, 0, -10}, {11.42, 0, 10}));
  EXPECT_FALSE(stands_between(box, {0, 0, -10}, {0, 0, 10}));
}

TEST(Box, contains_its_inside) {
  EXPECT_TRUE(contains(box, {10, 0, 1.9}));
  EXPECT_TRUE(contains(box, {11.4, 0, 0}));
  EXPECT_FALSE(contains(box, {11, 1, 0}));
  EXPECT_FALSE(contains(box, {10, 0, 2.1}));
}

TEST(Box, is_entered_at_its_face) {
  EXPECT_EQ(entry(box, {0, 0, -5}, {0, 0, 2}), 1.5);
  EXPECT_EQ(entry(box, {0, 0, 0}, {1, 0, 0}), 0.0);
  EXPECT_FALSE(entry(box, {0, 0, 5}, {0, 0, 1}));
}

}  // namespace
}  // namespace crumple
