#include "calib/refined_knowledge.h"

#include <algorithm>
#include <utility>

#include "solvers/decompositions.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

// Rows of what the rig's prior was about, in the rig's covariance and in a joint one of the prior's blocks.
struct TouchedRows {
  std::vector<BlockId> blocks;
  std::vector<int> in_rig;
  std::vector<int> in_joint;
  int joint_size = 0;
};

TouchedRows touched_rows(const Rig& rig, const StationRefinement& refined) {
  TouchedRows rows;
  for (const Prior& prior : refined.priors) {
    for (const BlockId& block : prior.blocks()) {
      if (block.is_pose()) continue;
      const std::vector<std::string> names = parameter_names(block, refined.bundle.state);
      rows.blocks.push_back(block);
      for (std::size_t i = 0; i < names.size(); ++i) {
        const auto found = std::find(rig.covariance.names.begin(), rig.covariance.names.end(), names[i]);
        if (found == rig.covariance.names.end()) continue;
        rows.in_rig.push_back(static_cast<int>(found - rig.covariance.names.begin()));
        rows.in_joint.push_back(rows.joint_size + static_cast<int>(i));
      }
      rows.joint_size += static_cast<int>(names.size());
    }
  }
  return rows;
}

}  // namespace

Expected<RefinedKnowledge> refined_knowledge(const Rig& rig, const std::vector<ObservedStation>& stations,
                                             const StationRefinement& refined) {
  const TouchedRows touched = touched_rows(rig, refined);
  std::vector<BlockId> blocks = touched.blocks;
  for (std::size_t s = 0; s < stations.size(); ++s) blocks.push_back({BlockId::Kind::station, s});
  const Eigen::MatrixXd joint = refined.bundle.covariance.of(blocks, refined.bundle.state);
  const auto six = 6 * static_cast<Eigen::Index>(stations.size());
  const Eigen::MatrixXd after = joint(touched.in_joint, touched.in_joint);
  const Eigen::MatrixXd poses_by_rig = joint.bottomRows(six)(Eigen::all, touched.in_joint);
  const Eigen::MatrixXd& given = rig.covariance.matrix;
  const Eigen::MatrixXd before = given(touched.in_rig, touched.in_rig);
  const auto root_before = inverse_cholesky_factor(before), root_after = inverse_cholesky_factor(after);
  if (!root_before || !root_after) return fail("the covariance of the refined stations is not positive definite");

  RefinedKnowledge result{rig.covariance, {}};
  const Eigen::MatrixXd carried = given(Eigen::all, touched.in_rig) * (root_before->transpose() * *root_before);  // K
  Eigen::MatrixXd& covariance = result.covariance.matrix;
  covariance += carried * (after - before) * carried.transpose();
  covariance = (0.5 * (covariance + covariance.transpose())).eval();

  const Eigen::MatrixXd by_touched = poses_by_rig * (root_after->transpose() * *root_after);  // G
  result.poses.d_rig = Eigen::MatrixXd::Zero(six, given.cols());
  for (std::size_t i = 0; i < touched.in_rig.size(); ++i) {
    result.poses.d_rig.col(touched.in_rig[i]) = by_touched.col(static_cast<Eigen::Index>(i));
  }
  const Eigen::MatrixXd noise = joint.bottomRightCorner(six, six) - by_touched * poses_by_rig.transpose();
  result.poses.covariance = 0.5 * (noise + noise.transpose());
  for (std::size_t s = 0; s < stations.size(); ++s) {
    result.poses.stations.push_back({stations[s].name, refined.stations[s].world_from_probe});
  }
  return result;
}

}  // namespace crumple
