#include "recon/merge.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/recon/made_surfaces.h"

namespace crumple {
namespace {

const Eigen::Vector3d above(0, 0, 600);

MergedCloud merge(const std::vector<Cloud>& stations, const MergeOptions& options) {
  CloudMerger merger(options);
  for (const Cloud& station : stations) merger.add(station);
  return merger.finish();
}

double rms_height(const Cloud& cloud) {
  double sum = 0;
  for (const CloudPoint& point : cloud.points) sum += point.position_mm.z() * point.position_mm.z();
  return std::sqrt(sum / static_cast<double>(cloud.points.size()));
}

double mean_sigma(const Cloud& cloud) {
  double sum = 0;
  for (const CloudPoint& point : cloud.points) sum += point.sigma_mm / static_cast<double>(cloud.points.size());
  return sum;
}

TEST(Merge, TwoPlanesOfOneNoiseFuseToHalfTheVariance) {
  const std::vector<Cloud> stations{made_surface(flat, 20, 0.5, above, 0.04, 1, "a"),
                                    made_surface(flat, 20, 0.5, above, 0.04, 2, "b")};
  const MergedCloud merged = merge(stations, {.spacing_mm = 0.5});
  EXPECT_EQ(merged.cloud.stations, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(merged.cloud.points.size(), 81U * 81U);
  // 6561 sites: the RMS is known to 0.9 %.
  EXPECT_NEAR(rms_height(merged.cloud), 0.04 / std::sqrt(2), 0.0009);
  EXPECT_NEAR(mean_sigma(merged.cloud), 0.04 / std::sqrt(2), 1e-4);
  EXPECT_NEAR(merged.report.overlap_share, 1, 1e-9);
  EXPECT_EQ(merged.report.contradictions + merged.report.outvoted, 0U);
  EXPECT_NEAR(merged.report.stations[1].difference_mm, 0.04 * std::sqrt(2), 0.003);
  EXPECT_NEAR(merged.report.stations[1].offset_mm, 0, 0.003);
}

TEST(Merge, TheBetterStationWeighsMoreButNotBeyondWhatIsCommon) {
  const std::vector<Cloud> stations{made_surface(flat, 20, 0.5, above, 0.01, 3, "a"),
                                    made_surface(flat, 20, 0.5, above, 0.09, 4, "b")};
  // By decoding alone: the variances' parallel sum. Where the common part dominates: nearly the plain mean.
  const MergedCloud alone = merge(stations, {.spacing_mm = 0.5, .common_sigma_mm = 0});
  EXPECT_NEAR(rms_height(alone.cloud), 1 / std::hypot(1 / 0.01, 1 / 0.09), 3e-4);
  EXPECT_NEAR(mean_sigma(alone.cloud), 1 / std::hypot(1 / 0.01, 1 / 0.09), 1e-4);
  const MergedCloud common = merge(stations, {.spacing_mm = 0.5, .common_sigma_mm = 5});
  EXPECT_NEAR(rms_height(common.cloud), std::hypot(0.01, 0.09) / 2, 1.5e-3);
  EXPECT_NEAR(mean_sigma(common.cloud), std::hypot(0.01, 0.09) / 2, 1e-4);
}

// The second stands a tenth too high, and may be turned about the y axis: by 0 at x = 0 and by 0.2 mm ten away.
TEST(Merge, AStationWeighsLessWhereItsPoseTellsLess) {
  CloudMerger merger({.spacing_mm = 0.5});
  merger.add(made_surface(flat, 12, 0.5, above, 0.001, 3, "a"));
  StationPlace turned;
  turned.covariance(1, 1) = 0.02 * 0.02;
  Cloud second = made_surface([](double, double) { return 0.1; }, 12, 0.5, above, 0.001, 4, "b");
  for (CloudPoint& point : second.points) point.view = 4;
  merger.add(second, turned);
  const MergedCloud merged = merger.finish();
  ASSERT_EQ(merged.report.contradictions, 0U);
  for (const CloudPoint& point : merged.cloud.points) {
    const double own = 0.05 * 0.05, turn = std::pow(0.02 * point.position_mm.x(), 2);
    EXPECT_NEAR(point.position_mm.z(), 0.1 * own / (own + own + turn), 0.003) << point.position_mm.x();
  }
  // Two shares a point, which say the same.
  const std::vector<CloudShare>& shares = merged.cloud.shares;
  ASSERT_EQ(shares.size(), 2 * merged.cloud.points.size());
  for (std::size_t i = 0; i < shares.size(); i += 2) {
    ASSERT_EQ(shares[i].point, i / 2);
    ASSERT_EQ(shares[i + 1].point, i / 2);
    EXPECT_NEAR(shares[i].weight + shares[i + 1].weight, 1, 1e-6);
    const CloudShare& of_second = shares[i].view == 4 ? shares[i] : shares[i + 1];
    EXPECT_EQ(of_second.view, 4);
    EXPECT_NEAR(0.1 * of_second.weight, merged.cloud.points[i / 2].position_mm.z(), 0.006);
  }
}

TEST(Merge, APointOfOneViewNeedsNoShares) {
  const MergedCloud merged = merge({made_surface(flat, 12, 0.5, above, 0.01, 3, "a")}, {.spacing_mm = 0.5});
  EXPECT_TRUE(merged.cloud.shares.empty());
}

TEST(Merge, SpacingSetsTheNumberOfPointsAndTheNoiseFollows) {
  const Cloud fine = made_surface(flat, 20, 0.25, above, 0.04, 5);
  const MergedCloud merged = merge({fine}, {.spacing_mm = 1});
  // Sites are at least 0.75 apart and leave no gap wider than that.
  EXPECT_GT(merged.cloud.points.size(), 40U * 40U * 8 / 10);
  EXPECT_LT(merged.cloud.points.size(), 40U * 40U * 17 / 10);
  EXPECT_NEAR(rms_height(merged.cloud) / mean_sigma(merged.cloud), 1, 0.08);
  EXPECT_LT(mean_sigma(merged.cloud), 0.015);
  EXPECT_EQ(merged.report.overlap_share, 0);
}

TEST(Merge, SurfacesThatContradictAreNotAveraged) {
  const auto bump = [](double x, double y) { return std::hypot(x, y) < 4 ? 1.5 : 0.0; };
  const Cloud a = made_surface(flat, 15, 0.5, above, 0.02, 6, "a"),
              b = made_surface(flat, 15, 0.5, above, 0.02, 7, "b"),
              c = made_surface(bump, 15, 0.5, above, 0.02, 8, "c");
  const auto bumped = [](const Cloud& cloud) {
    return std::count_if(cloud.points.begin(), cloud.points.end(),
                         [](const CloudPoint& p) { return p.position_mm.z() > 1; });
  };
  for (const CloudPoint& point : merge({a, c}, {.spacing_mm = 0.5}).cloud.points) {
    EXPECT_TRUE(std::abs(point.position_mm.z()) < 0.2 || std::abs(point.position_mm.z() - 1.5) < 0.2);
  }
  // One against one: both stay, marked. One against two: it is left out.
  const MergedCloud pair = merge({a, c}, {.spacing_mm = 0.5});
  EXPECT_EQ(pair.report.contradictions, 2U * static_cast<std::size_t>(bumped(c)));
  EXPECT_EQ(pair.report.outvoted, 0U);
  EXPECT_EQ(std::count_if(pair.cloud.points.begin(), pair.cloud.points.end(),
                          [](const CloudPoint& p) { return p.quality == 0; }),
            static_cast<std::ptrdiff_t>(pair.report.contradictions));
  const MergedCloud three = merge({a, c, b}, {.spacing_mm = 0.5});
  EXPECT_EQ(three.report.outvoted, static_cast<std::size_t>(bumped(c)));
  EXPECT_EQ(bumped(three.cloud), 0);
}

TEST(Merge, ASmallContradictionIsSplitOff) {
  // 0.6 mm is within a spacing but beyond five sigma of both; 45 points of the grid are in the dent.
  const auto dent = [](double x, double y) { return std::hypot(x, y) < 4 ? -0.6 : 0.0; };
  const MergedCloud merged =
      merge({made_surface(flat, 15, 1, above, 0.02, 9, "a"), made_surface(dent, 15, 1, above, 0.02, 10, "b")},
            {.spacing_mm = 1});
  EXPECT_EQ(merged.report.stations[1].split, 45U);
  EXPECT_EQ(merged.report.contradictions, 90U);
}

TEST(Merge, AStepThatAStationSawBothSidesOfIsNoContradiction) {
  const auto step = [](double x, double) { return x > 0.1 ? 1.0 : 0.0; };
  const MergedCloud merged =
      merge({made_surface(step, 10, 0.5, above, 0.02, 11, "a"), made_surface(step, 10, 0.5, above, 0.02, 12, "b")},
            {.spacing_mm = 0.5});
  EXPECT_EQ(merged.report.contradictions + merged.report.outvoted, 0U);
}

TEST(Merge, AStationThatIsOffAsAWholeIsSaidAndStillFused) {
  const MergedCloud merged = merge({made_surface(flat, 10, 1, above, 0.02, 13, "a"),
                                    made_surface([](double, double) { return 0.5; }, 10, 1, above, 0.02, 14, "b")},
                                   {.spacing_mm = 1});
  EXPECT_NEAR(merged.report.stations[1].offset_mm, 0.5, 0.01);
  EXPECT_EQ(merged.report.stations[1].split, 0U);
  EXPECT_NEAR(merged.cloud.points[100].position_mm.z(), 0.25, 0.1);
}

TEST(Merge, BothSidesOfASheetStayApart) {
  Cloud back = made_surface([](double, double) { return -0.4; }, 10, 1, -above, 0.02, 15, "b");
  for (CloudPoint& point : back.points) point.normal = -point.normal;
  const MergedCloud merged = merge({made_surface(flat, 10, 1, above, 0.02, 16, "a"), back}, {.spacing_mm = 1});
  EXPECT_EQ(merged.report.points_out, 2U * 21U * 21U);
  EXPECT_EQ(merged.report.contradictions, 0U);
}

TEST(Merge, PointsWithoutANormalAreCounted) {
  Cloud cloud = made_surface(flat, 5, 1, above, 0.02, 17);
  cloud.points[3].normal.setZero();
  const MergedCloud merged = merge({cloud}, {.spacing_mm = 1});
  EXPECT_EQ(merged.report.without_normal, 1U);
  EXPECT_EQ(merged.report.points_out, 120U);
}

RC_GTEST_PROP(Merge, PointsLieWithinTheirSitesAndTheCloudDoesNotGrowWithStations, ()) {
  const auto seed = *rc::gen::inRange(0U, 1000U);
  const auto wave = [](double x, double y) { return 0.5 * std::sin(0.2 * x) * std::cos(0.15 * y); };
  std::vector<Cloud> stations;
  for (unsigned i = 0; i < 5; ++i)
    stations.push_back(made_surface(wave, 10, 0.5, above, 0.02, seed + i, std::to_string(i)));
  const MergedCloud first = merge({stations.front()}, {.spacing_mm = 0.6});
  const MergedCloud all = merge(stations, {.spacing_mm = 0.6});
  RC_ASSERT(all.cloud.points.size() <= first.cloud.points.size() + first.cloud.points.size() / 20);
  for (const CloudPoint& point : all.cloud.points) {
    RC_ASSERT(std::abs(point.position_mm.z() - wave(point.position_mm.x(), point.position_mm.y())) < 0.12);
    RC_ASSERT(std::abs(point.normal.norm() - 1) < 1e-5F);
  }
}

TEST(Merge, SameAtAnyNumberOfThreads) {
  const std::vector<Cloud> stations{made_surface(flat, 40, 0.5, above, 0.04, 18, "a"),
                                    made_surface(flat, 40, 0.6, above, 0.04, 19, "b")};
  const MergedCloud one = merge(stations, {.spacing_mm = 0.5, .threads = 1}),
                    three = merge(stations, {.spacing_mm = 0.5, .threads = 3});
  ASSERT_EQ(one.cloud.points.size(), three.cloud.points.size());
  for (std::size_t i = 0; i < one.cloud.points.size(); ++i) {
    EXPECT_EQ(one.cloud.points[i].position_mm, three.cloud.points[i].position_mm);
    EXPECT_EQ(one.cloud.points[i].sigma_mm, three.cloud.points[i].sigma_mm);
  }
}

}  // namespace
}  // namespace crumple
