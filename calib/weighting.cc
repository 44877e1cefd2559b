#include "calib/weighting.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "calib/uncertainty_budget.h"
#include "calib/whitened_view.h"
#include "solvers/decompositions.h"
#include "solvers/normal_equations.h"

namespace crumple {
namespace {

// Groups whose variance is one estimate.
struct Component {
  std::set<std::size_t> groups;  // of the bundle
  double degrees_of_freedom = 0;
};

std::vector<Component> components_of(const Calibration& calibration) {
  const BundleResult& bundle = calibration.bundle;
  const std::vector<BudgetSource> sources = budget_sources(calibration);
  std::vector<Component> components;
  std::map<std::pair<View::Kind, Mount>, Component> pooled;
  std::map<View::Kind, Component> kinds;
  for (std::size_t g = 0; g < bundle.groups.size(); ++g) {
    const GroupSummary& group = bundle.groups[g];
    const double of_sigma = sources[g].sigma_degrees_of_freedom;
    if (std::isfinite(of_sigma)) {
      const bool own = group.redundancy >= BundleOptions{}.minimum_redundancy;
      const Mount mount = bundle.state.rig.sensors[group.sensor].mount;
      Component& component = own ? components.emplace_back() : pooled[{group.kind, mount}];
      component.groups.insert(g);
      component.degrees_of_freedom = of_sigma;
    }
    if (std::isfinite(sources[g].inflation_degrees_of_freedom)) {
      kinds[group.kind].groups.insert(g);
      kinds[group.kind].degrees_of_freedom = sources[g].inflation_degrees_of_freedom;
    }
  }
  for (const auto& [key, component] : pooled) components.push_back(component);
  for (const auto& [kind, component] : kinds) components.push_back(component);
  std::erase_if(components, [](const Component& c) { return !(c.degrees_of_freedom > 0); });
  return components;
}

// N_k - N_k C N_k by the common parameters, poses eliminated as in C. Poses follow the common parameters by -G_j', so
// that observations are told by the common ones through J_a - J_b G'.
Eigen::MatrixXd shared_information(const NormalEquations& part, const JointCovariance& covariance) {
  Eigen::MatrixXd information = part.common();
  Eigen::MatrixXd by_poses = Eigen::MatrixXd::Zero(information.rows(), information.cols());
  for (std::size_t p = 0; p < part.eliminated().size(); ++p) {
    const PoseEquations& pose = part.eliminated()[p];
    if (pose.information.isZero(0)) continue;
    const auto& gain = covariance.gain(p);
    const Eigen::Matrix<double, Eigen::Dynamic, 6> with_pose = pose.coupling - gain * pose.information;
    const Eigen::MatrixXd followed = gain * pose.coupling.transpose();
    information -= followed + with_pose * gain.transpose();
    by_poses.noalias() += with_pose * covariance.pose_inverse(p) * with_pose.transpose();
  }
  return information - information * covariance.common() * information - by_poses;
}

// A sum of parts of at most a quarter each, less what rounding has made of it.
Eigen::MatrixXd clipped(const Eigen::MatrixXd& matrix, double most) {
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (matrix + matrix.transpose()));
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseMin(most).asDiagonal() * eigen.vectors.transpose();
}

}  // namespace

Eigen::MatrixXd weighting_covariance(const Observations& observations, const Calibration& calibration, int threads) {
  const BundleResult& bundle = calibration.bundle;
  const JointCovariance& covariance = bundle.covariance;
  const Eigen::Index n = covariance.common().rows();
  const auto group_of = [&](const View& view) {
    const auto found = std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& group) {
      return group.sensor == view.sensor() && group.kind == view.kind();
    });
    return static_cast<std::size_t>(found - bundle.groups.begin());
  };
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  double most = 0;
  for (const Component& component : components_of(calibration)) {
    std::vector<std::unique_ptr<View>> views;
    std::vector<std::size_t> numbers;
    auto all = make_views(observations, bundle.state.board_of);
    for (std::size_t v = 0; v < all.size(); ++v) {
      if (!component.groups.contains(group_of(*all[v])) || !counted(calibration, v)) continue;
      views.push_back(std::move(all[v]));
      numbers.push_back(v);
    }
    const auto part = NormalEquations::of(
        views, covariance.parameters(),
        [&](std::size_t i, ViewEvaluation& at) { return whitened_view(calibration, *views[i], numbers[i], at); },
        threads);
    if (!part) continue;  // cannot be: what counted was predicted
    sum += 4 / component.degrees_of_freedom * shared_information(*part, covariance);
    most += 1 / component.degrees_of_freedom;
  }
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(covariance.common()).matrixL();
  return root * clipped(root.transpose() * sum * root, most) * root.transpose();
}

}  // namespace crumple
