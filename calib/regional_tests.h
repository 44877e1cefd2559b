// Are the residuals of a group of observations white over its sensor's image? Of each of the image's nine parts the
// mean residual is compared with what noise makes of it: with sum n n' / sigma^2 the weight of a part's residuals (the
// identity for those of two coordinates), its mean m has the statistic m' W m, chi-square distributed with as many
// degrees of freedom as coordinates are known there, over the number of observations that count as one
// (calib/correlation.h). The parts' sum tests the group, the largest names the part.
//
// It is a test that the group's sigma has little part in, as that follows the scatter about the means. The fit follows
// some of the noise, so that a right model is found guilty less often than stated. With many observations a pattern of
// a hundredth of a sigma is significant: a pattern is only spoken of where the means, of all parts (RMS) or of a part
// that is significant by itself, are also kPatternSigmas of a reading's sigma, which is 2 % of the scatter.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/correlation.h"
#include "calib/placed_residuals.h"

namespace crumple {

struct RegionalTest {
  std::size_t sensor = 0;
  View::Kind kind = View::Kind::corners;
  int parts = 0;  // that observations tell a mean of
  double chi_square = 0;
  int degrees_of_freedom = 0;
  double probability = 1;        // of a larger chi-square by chance
  std::string worst_part = {};   // empty without parts
  double worst_probability = 1;  // of that part by chance, over all parts
  Eigen::Vector2d worst_mean_px = Eigen::Vector2d::Zero();
  // Of a coordinate, in sigmas of a reading: of that part, and RMS over all parts without what noise makes of it.
  double worst_sigmas = 0;
  double rms_sigmas = 0;
  bool part_by_itself = false;  // some part's mean is significant over all parts, and kPatternSigmas

  bool pattern() const;
};

inline constexpr double kPatternProbability = 1e-4;
inline constexpr double kPatternSigmas = 0.2;

// One per group, in their order. `residuals` are those of all sensors (calib/placed_residuals.h).
std::vector<RegionalTest> regional_tests(const std::vector<std::vector<PlacedResidual>>& residuals,
                                         const std::vector<GroupSummary>& groups, const Rig& rig,
                                         const Inflation& inflation);

}  // namespace crumple
