#include "tracking/motion_selection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>

#include "tracking/median.h"

namespace crumple {
namespace {

constexpr std::size_t kMostPoses = 60;
constexpr std::size_t kMostMotions = 200;
constexpr double kLargestTurn_rad = 160 * std::numbers::pi / 180;
constexpr double kInvariantGate = 5;
constexpr double kNormalSigma = 1.4826;  // over the median of absolute values
constexpr double kInvariantFloor_rad = 1e-9, kInvariantFloor_mm = 1e-6;

// Farthest-point sampling, from the first pose on.
std::vector<std::size_t> spread_poses(const std::vector<PosePair>& pairs) {
  std::vector<double> distance(pairs.size(), std::numeric_limits<double>::infinity());
  std::vector<std::size_t> chosen{0};
  while (chosen.size() < std::min(kMostPoses, pairs.size())) {
    const Eigen::Quaterniond& last = pairs[chosen.back()].world_from_hand.rotation;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      distance[i] = std::min(distance[i], last.angularDistance(pairs[i].world_from_hand.rotation));
    }
    distance[chosen.back()] = -1;
    chosen.push_back(static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin()));
  }
  return chosen;
}

struct Candidate {
  HandEyeMotion motion;
  double angle_difference_rad;
  double shift_difference_mm;
};

double shift_along_axis(const Pose& motion) {
  return rotation_vector(motion.rotation).normalized().dot(motion.translation);
}

std::vector<Candidate> candidates_among(const std::vector<PosePair>& pairs, const std::vector<std::size_t>& chosen) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const PosePair& first = pairs[chosen[i]];
    for (std::size_t j = i + 1; j < chosen.size(); ++j) {
      const PosePair& second = pairs[chosen[j]];
      const HandEyeMotion motion{first.world_from_hand.inverse() * second.world_from_hand,
                                 first.board_from_eye.inverse() * second.board_from_eye};
      const double hand = rotation_vector(motion.hand.rotation).norm(),
                   eye = rotation_vector(motion.eye.rotation).norm();
      if (std::max(hand, eye) > kLargestTurn_rad) continue;
      candidates.push_back(
          {motion, std::abs(hand - eye), std::abs(shift_along_axis(motion.hand) - shift_along_axis(motion.eye))});
    }
  }
  return candidates;
}

std::vector<HandEyeMotion> agreeing(const std::vector<Candidate>& candidates) {
  if (candidates.empty()) return {};
  std::vector<double> angles, shifts;
  for (const Candidate& c : candidates) {
    angles.push_back(c.angle_difference_rad);
    shifts.push_back(c.shift_difference_mm);
  }
  const double angle_gate = kInvariantGate * kNormalSigma * median_of(angles) + kInvariantFloor_rad;
  const double shift_gate = kInvariantGate * kNormalSigma * median_of(shifts) + kInvariantFloor_mm;
  std::vector<HandEyeMotion> motions;
  for (const Candidate& c : candidates) {
    if (c.angle_difference_rad <= angle_gate && c.shift_difference_mm <= shift_gate) motions.push_back(c.motion);
  }
  return motions;
}

Eigen::Matrix3d information_of(const HandEyeMotion& motion) {
  const Eigen::Vector3d turn = 2 * motion.hand.rotation.vec();
  return turn.squaredNorm() * Eigen::Matrix3d::Identity() - turn * turn.transpose();
}

std::vector<HandEyeMotion> best_conditioned(const std::vector<HandEyeMotion>& motions) {
  if (motions.size() <= kMostMotions) return motions;
  std::vector<Eigen::Matrix3d> information;
  for (const HandEyeMotion& motion : motions) information.push_back(information_of(motion));
  std::vector<char> taken(motions.size(), 0);
  std::vector<HandEyeMotion> best;
  Eigen::Matrix3d sum = 1e-6 * Eigen::Matrix3d::Identity();
  while (best.size() < kMostMotions) {
    double largest = -1;
    std::size_t next = 0;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (taken[i] != 0) continue;
      const double determinant = (sum + information[i]).determinant();
      if (determinant > largest) {
        largest = determinant;
        next = i;
      }
    }
    taken[next] = 1;
    sum += information[next];
    best.push_back(motions[next]);
  }
  return best;
}

}  // namespace

SelectedMotions select_motions(const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return {};
  const std::vector<Candidate> candidates = candidates_among(pairs, spread_poses(pairs));
  const std::vector<HandEyeMotion> motions = agreeing(candidates);
  return {best_conditioned(motions), candidates.size(), candidates.size() - motions.size()};
}

}  // namespace crumple
