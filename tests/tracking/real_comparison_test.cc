#include "tests/tracking/real_comparison.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/temporary_folder.h"
#include "tests/tracking/opencv_hand_eye.h"
#include "tracking/hand_eye_verdict.h"

namespace crumple {
namespace {

struct Expectation {
  double offset_s;
  Eigen::Vector3d translation_mm;  // within a few of its sigmas
  double scatter_mm;               // of the accepted pairs, at most
};

void check(const RealHandEye& set, const Expectation& expected) {
  const TemporaryFolder folder;
  const auto unpacked = unpack(set, folder.path());
  if (!unpacked) GTEST_SKIP() << "the recording " << set.name << " is not there; set CRUMPLE_DATA";
  const auto comparison = compare_on_recording(set, *unpacked);
  ASSERT_TRUE(comparison) << comparison.error().message;
  const HandEyeCalibration& found = comparison->calibration;
  EXPECT_TRUE(judge(found).ok);
  EXPECT_NEAR(found.fit.state.offset_s, expected.offset_s, 2e-3);
  EXPECT_NEAR(found.offset->offset_s, expected.offset_s, 0.02);
  EXPECT_LT((found.fit.state.hand_from_eye.translation - expected.translation_mm).norm(), 3);
  EXPECT_LT(found.scatter.rms_mm, expected.scatter_mm);
  // Whether the README's figure is an RMS, and over which pairs, it does not say (docs/tracking.md).
  EXPECT_LT(found.scatter.median_mm, set.quick_look_mm);
  EXPECT_GT(found.scatter.pairs, 9 * found.fit.pairs.size() / 10);
  for (const PairSetComparison& pairs : comparison->sets) {
    const double ours = pairs.methods[0].scatter.rms_mm, of_all = pairs.methods[1].scatter.rms_mm;
    for (std::size_t m = 2; m < pairs.methods.size(); ++m) {
      EXPECT_LT(ours, pairs.methods[m].scatter.rms_mm) << pairs.pairs << ", " << pairs.methods[m].method;
    }
    EXPECT_LT(of_all, 1.03 * ours) << pairs.pairs;
  }
}

TEST(RealHandEye, ViconAndCamera) { check(kRealHandEye[0], {0.0193, {75.6, 41.6, 24.8}, 9.5}); }

TEST(RealHandEye, ArmAndCamera) { check(kRealHandEye[1], {-0.0168, {1.6, -16.6, 6.1}, 3.2}); }

}  // namespace
}  // namespace crumple
