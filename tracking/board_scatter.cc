#include "tracking/board_scatter.h"

#include <cassert>
#include <cmath>

#include "solvers/decompositions.h"
#include "tracking/median.h"

namespace crumple {
namespace {

// The unit quaternion with the largest sum of squared products with the others.
Eigen::Quaterniond mean_rotation(const std::vector<Pose>& poses) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Pose& pose : poses) sum += pose.rotation.coeffs() * pose.rotation.coeffs().transpose();
  return Eigen::Quaterniond(Eigen::Vector4d(symmetric_eigen(sum).vectors.col(3)));
}

double median_distance(const std::vector<Pose>& boards) {
  Eigen::Vector3d median;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Pose& board : boards) values.push_back(board.translation[axis]);
    median[axis] = median_of(values);
  }
  std::vector<double> distances;
  for (const Pose& board : boards) distances.push_back((board.translation - median).norm());
  return median_of(distances);
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
  BoardScatter scatter{.pairs = boards.size(), .median_mm = median_distance(boards)};
  for (const Pose& board : boards) {
    scatter.rms_mm += (board.translation - mean).squaredNorm() / count;
    scatter.rms_rad += std::pow(board.rotation.angularDistance(rotation), 2) / count;
  }
  scatter.rms_mm = std::sqrt(scatter.rms_mm);
  scatter.rms_rad = std::sqrt(scatter.rms_rad);
  return scatter;
}

}  // namespace crumple
