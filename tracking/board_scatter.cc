#include "tracking/board_scatter.h"

#include <cassert>
#include <cmath>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

// The unit quaternion with the largest sum of squared products with the others.
Eigen::Quaterniond mean_rotation(const std::vector<Pose>& poses) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Pose& pose : poses) sum += pose.rotation.coeffs() * pose.rotation.coeffs().transpose();
  return Eigen::Quaterniond(Eigen::Vector4d(symmetric_eigen(sum).vectors.col(3)));
}

}  // namespace

BoardScatter board_scatter(const std::vector<PosePair>& pairs, const std::vector<char>& accepted,
                           const Pose& hand_from_eye) {
  std::vector<Pose> boards;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!accepted.empty() && accepted[i] == 0) continue;
    boards.push_back(pairs[i].world_from_hand * hand_from_eye * pairs[i].board_from_eye.inverse());
    mean += boards.back().translation;
  }
  assert(!boards.empty());
  const auto count = static_cast<double>(boards.size());
  mean /= count;
  const Eigen::Quaterniond rotation = mean_rotation(boards);
  BoardScatter scatter{boards.size(), 0, 0};
  for (const Pose& board : boards) {
    scatter.rms_mm += (board.translation - mean).squaredNorm() / count;
    scatter.rms_rad += std::pow(board.rotation.angularDistance(rotation), 2) / count;
  }
  scatter.rms_mm = std::sqrt(scatter.rms_mm);
  scatter.rms_rad = std::sqrt(scatter.rms_rad);
  return scatter;
}

}  // namespace crumple
