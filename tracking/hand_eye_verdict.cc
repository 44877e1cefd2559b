#include "tracking/hand_eye_verdict.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kClearOfNoise = 5;
constexpr double kLargestSigma_rad = 0.5 * std::numbers::pi / 180;
constexpr double kLargestSigma_mm = 5;
constexpr std::size_t kFewPairs = 5;
constexpr double kManyOutliers = 0.25;
constexpr double kOffsetSigmas = 5, kOffsetFloor_s = 5e-3;

// The direction known least, and its sigma.
struct Weakest {
  double sigma;
  Eigen::Vector3d direction;
};

Weakest weakest(const Eigen::Matrix3d& covariance) {
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  return {std::sqrt(std::max(0.0, eigen.values[2])), eigen.vectors.col(2)};
}

std::string direction_text(const Eigen::Vector3d& d) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", d.x(), d.y(), d.z());
}

void judge_conditioning(const MotionConditioning& c, HandEyeVerdict& verdict) {
  const double least = kClearOfNoise * c.disagreement_rad;
  constexpr double degree = std::numbers::pi / 180;
  if (c.turn_rad < least) {
    verdict.reasons.push_back(
        fmt::format("the rotations are hardly larger than the noise: {:.3g} deg RMS, where hand and eye disagree by "
                    "{:.3g} deg; turn the hand further",
                    c.turn_rad / degree, c.disagreement_rad / degree));
  } else if (c.cross_turn_rad < least) {
    verdict.reasons.push_back(fmt::format(
        "the rotations' axes are nearly parallel: about {} of the hand {:.3g} deg RMS, about all others "
        "{:.3g} deg, where hand and eye disagree by {:.3g} deg; turn the hand about two different axes",
        direction_text(c.main_axis), c.turn_rad / degree, c.cross_turn_rad / degree, c.disagreement_rad / degree));
  }
}

void judge_sigmas(const HandEyeFit& fit, HandEyeVerdict& verdict) {
  const Weakest turn = weakest(fit.covariance.topLeftCorner<3, 3>());
  const Weakest shift = weakest(fit.covariance.block<3, 3>(3, 3));
  if (!(turn.sigma <= kLargestSigma_rad)) {
    verdict.reasons.push_back(fmt::format(
        "the rotation about {} of the hand is uncertain: sigma {:.2f} deg; turn the hand further, about other axes",
        direction_text(turn.direction), turn.sigma * 180 / std::numbers::pi));
  }
  if (!(shift.sigma <= kLargestSigma_mm)) {
    verdict.reasons.push_back(fmt::format(
        "the position along {} of the hand is uncertain: sigma {:.1f} mm; turn the hand further, about other axes",
        direction_text(shift.direction), shift.sigma));
  }
}

}  // namespace

HandEyeVerdict judge(const HandEyeCalibration& calibration) {
  HandEyeVerdict verdict;
  const HandEyeFit& fit = calibration.fit;
  judge_conditioning(calibration.start.conditioning, verdict);
  judge_sigmas(fit, verdict);
  const auto accepted = static_cast<std::size_t>(std::count(fit.accepted.begin(), fit.accepted.end(), 1));
  const double left_out = 1 - static_cast<double>(accepted) / static_cast<double>(fit.accepted.size());
  if (accepted < kFewPairs) {
    verdict.reasons.push_back(fmt::format("{} pairs of poses hardly check each other; take ten or more", accepted));
  }
  if (left_out > kManyOutliers) {
    verdict.reasons.push_back(
        fmt::format("{:.0f} % of the pairs do not agree with the others and were left out", 100 * left_out));
  }
  if (calibration.offset) {
    const double sigma_s = std::hypot(calibration.offset->sigma_s, std::sqrt(fit.covariance(12, 12)));
    const double difference_s = std::abs(calibration.offset->offset_s - fit.state.offset_s);
    if (difference_s > std::max(kOffsetFloor_s, kOffsetSigmas * sigma_s)) {
      verdict.reasons.push_back(
          fmt::format("angular rates and poses disagree on the time offset by {:.1f} ms; does one of the clocks drift?",
                      1e3 * difference_s));
    }
  }
  verdict.ok = verdict.reasons.empty();
  return verdict;
}

}  // namespace crumple
