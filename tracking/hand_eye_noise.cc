#include "tracking/hand_eye_noise.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "tracking/median.h"

namespace crumple {
namespace {

constexpr double kMedianOfThree = 2.366;
constexpr double kFloor_rad = 1e-12, kFloor_mm = 1e-9;  // made poses without noise
constexpr std::size_t kPairsForShare = 8;
constexpr double kParametersOfEach = 6;
constexpr int kSections = 25;

// Squares of e along and across the lever, for one hand's share.
struct Split {
  double along;
  double across;
  double lever_square;
};

std::vector<Split> splits(const std::vector<HandEyeResidual>& residuals, double share) {
  std::vector<Split> all;
  for (const HandEyeResidual& r : residuals) {
    const Eigen::Vector3d e = r.position_mm - share * r.rotation_rad.cross(r.lever_mm);
    const double lever_square = r.lever_mm.squaredNorm();
    const double along = lever_square > 0 ? std::pow(e.dot(r.lever_mm), 2) / lever_square : 0;
    all.push_back({along, std::max(0.0, e.squaredNorm() - along), lever_square});
  }
  return all;
}

// Minus twice the log likelihood of e, up to a constant.
double unlikelihood(const std::vector<Split>& splits, double swing_square, double position_mm) {
  const double own = position_mm * position_mm;
  double sum = 0;
  for (const Split& s : splits) {
    const double across = own + swing_square * s.lever_square;
    sum += s.along / own + std::log(own) + s.across / across + 2 * std::log(across);
  }
  return sum;
}

// By golden section; the functions here have one minimum.
double minimum_between(double low, double high, const std::function<double(double)>& function) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = function(left), at_right = function(right);
  for (int i = 0; i < kSections; ++i) {
    if (at_left < at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = function(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = function(right);
    }
  }
  return 0.5 * (low + high);
}

double position_sigma(const std::vector<Split>& splits, double swing_square) {
  double squares = 0;
  for (const Split& s : splits) squares += s.along + s.across;
  const double largest = std::sqrt(squares / (3 * static_cast<double>(splits.size()))) + kFloor_mm;
  const double log_sigma = minimum_between(std::log(1e-3 * largest), std::log(2 * largest), [&](double log) {
    return unlikelihood(splits, swing_square, std::exp(log));
  });
  return std::exp(log_sigma);
}

}  // namespace

HandEyeNoise robust_noise(const std::vector<HandEyeResidual>& residuals) {
  std::vector<double> rotations, positions;
  for (const HandEyeResidual& r : residuals) {
    rotations.push_back(r.rotation_rad.squaredNorm());
    positions.push_back(r.position_mm.squaredNorm());
  }
  return {std::sqrt(median_of(rotations) / kMedianOfThree) + kFloor_rad,
          std::sqrt(median_of(positions) / kMedianOfThree) + kFloor_mm, 0};
}

HandEyeNoise most_likely_noise(const std::vector<HandEyeResidual>& accepted) {
  const double observations = 3 * static_cast<double>(accepted.size());
  const double redundancy = observations - kParametersOfEach;
  double squares = 0;
  for (const HandEyeResidual& r : accepted) squares += r.rotation_rad.squaredNorm();
  HandEyeNoise noise;
  noise.rotation_rad = std::sqrt(squares / redundancy) + kFloor_rad;
  const auto swing = [&](double share) { return share * (1 - share) * noise.rotation_rad * noise.rotation_rad; };
  if (accepted.size() >= kPairsForShare) {
    noise.hand_share = minimum_between(0, 1, [&](double share) {
      const std::vector<Split> parts = splits(accepted, share);
      return unlikelihood(parts, swing(share), position_sigma(parts, swing(share)));
    });
  }
  noise.position_mm = std::sqrt(observations / redundancy) *
                          position_sigma(splits(accepted, noise.hand_share), swing(noise.hand_share)) +
                      kFloor_mm;
  return noise;
}

}  // namespace crumple
