#include "calib/regional_tests.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calib/image_parts.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

constexpr double kLeastReadings = 3;  // that a direction is known by

struct PartSums {
  Eigen::Matrix2d weight = Eigen::Matrix2d::Zero();    // sum n n' / sigma^2
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();  // sum n n' r / sigma^2
  double sigma_px = 0;
};

struct PartMean {
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
  double square = 0;
  // Of the mean in sigmas of a reading, summed over directions, and what noise makes of it.
  double mean_square = 0;
  double noise_square = 0;
  int degrees = 0;
};

// In the directions that enough readings know; others tell nothing of the mean.
PartMean mean_of(const PartSums& sums) {
  PartMean mean;
  const SymmetricEigen2 eigen = symmetric_eigen2(sums.weight);
  for (int i = 0; i < 2; ++i) {
    const double weight = eigen.values[i];
    const double readings = weight * sums.sigma_px * sums.sigma_px;
    if (readings < kLeastReadings - 1e-6) continue;
    const double along = eigen.vectors.col(i).dot(sums.weighted);
    mean.mean_px += eigen.vectors.col(i) * (along / weight);
    mean.square += along * along / weight;
    mean.mean_square += along * along / (weight * readings);
    mean.noise_square += 1 / readings;
    ++mean.degrees;
  }
  return mean;
}

}  // namespace

bool RegionalTest::pattern() const {
  return probability < kPatternProbability && (part_by_itself || rms_sigmas >= kPatternSigmas);
}

std::vector<RegionalTest> regional_tests(const std::vector<std::vector<PlacedResidual>>& residuals,
                                         const std::vector<GroupSummary>& groups, const Rig& rig,
                                         const Inflation& inflation) {
  std::vector<RegionalTest> tests;
  for (const GroupSummary& group : groups) {
    const ImageSize size = rig.sensors[group.sensor].lens.size();
    std::array<PartSums, kImagePartNames.size()> parts;
    for (const PlacedResidual& residual : residuals[group.sensor]) {
      if (residual.kind != group.kind || !residual.accepted) continue;
      PartSums& part = parts[image_part(residual.pixel, size)];
      Eigen::Matrix2d weight = Eigen::Matrix2d::Identity();
      if (residual.normal) weight = *residual.normal * residual.normal->transpose();
      weight /= residual.sigma_px * residual.sigma_px;
      part.weight += weight;
      part.weighted += weight * residual.residual_px;
      part.sigma_px = residual.sigma_px;
    }
    RegionalTest test{.sensor = group.sensor, .kind = group.kind};
    double worst_square = 0;  // of one degree: far in the tail probabilities are all 0
    double beyond_noise = 0;
    double least_of_large = 1;  // probability of a part whose mean is large enough to be spoken of
    for (std::size_t p = 0; p < parts.size(); ++p) {
      PartMean mean = mean_of(parts[p]);
      if (mean.degrees == 0) continue;
      mean.square /= inflation.of(group.kind);
      ++test.parts;
      test.chi_square += mean.square;
      test.degrees_of_freedom += mean.degrees;
      beyond_noise += mean.mean_square - inflation.of(group.kind) * mean.noise_square;
      const double probability = chi_square_tail(mean.square, mean.degrees);
      const double square = mean.square / mean.degrees, sigmas = std::sqrt(mean.mean_square / mean.degrees);
      if (sigmas >= kPatternSigmas) least_of_large = std::min(least_of_large, probability);
      if (!test.worst_part.empty() &&
          std::pair(probability, -square) >= std::pair(test.worst_probability, -worst_square)) {
        continue;
      }
      worst_square = square;
      test.worst_sigmas = sigmas;
      test.worst_part = kImagePartNames[p];
      test.worst_probability = probability;
      test.worst_mean_px = mean.mean_px;
    }
    test.probability = chi_square_tail(test.chi_square, test.degrees_of_freedom);
    if (test.parts > 0) test.rms_sigmas = std::sqrt(std::max(0.0, beyond_noise) / test.degrees_of_freedom);
    test.part_by_itself = least_of_large * test.parts < kPatternProbability;
    test.worst_probability = std::min(1.0, test.worst_probability * test.parts);
    if (test.parts == 0) test.worst_probability = 1;
    tests.push_back(std::move(test));
  }
  return tests;
}

}  // namespace crumple
