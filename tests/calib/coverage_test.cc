// A small part of `./dev bench coverage`, with seeds of its own.
#include "tests/calib/coverage.h"

#include <cmath>

#include <gtest/gtest.h>

namespace crumple {
namespace {

class Coverage : public testing::TestWithParam<const char*> {};

TEST_P(Coverage, RegionsOf95PercentContainTheTruthAsOftenAsTheySay) {
  static const auto configurations = coverage_configurations();
  ASSERT_TRUE(configurations) << configurations.error().message;
  for (const CoverageConfiguration& configuration : *configurations) {
    if (configuration.name != GetParam()) continue;
    const CoverageResult result = measure_coverage(configuration, 7, 32, 1);
    EXPECT_EQ(result.failed, 0) << result.failure;
    EXPECT_LT(std::abs(result.worst_direction_z), 4);
    ASSERT_FALSE(result.rows.empty());
    for (const CoverageRow& row : result.rows) {
      EXPECT_NEAR(row.coverage95, 0.95, 3.3 * row.coverage_error) << row.quantity;
      EXPECT_NEAR(row.nees_per_dof, 1, 3.3 * row.nees_error) << row.quantity;
    }
    return;
  }
  FAIL() << "there is no configuration " << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Configurations, Coverage,
                         testing::Values("one camera, OPENCV5", "camera and projector by stripes"));

}  // namespace
}  // namespace crumple
