#include "calib/weighting.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "calib/whitened_view.h"
#include "solvers/decompositions.h"
#include "solvers/gate.h"
#include "solvers/normal_equations.h"

namespace crumple {
namespace {

// Groups whose variance is one estimate.
struct Component {
  std::vector<std::size_t> groups;  // of the bundle
  double coordinates = 0;           // accepted
  double redundancy = 0;
  double effective = 1;  // degrees of freedom of the estimate for each of redundancy
};

// Each group's sigma, or that of the small groups of a kind, which have that of all of the kind.
std::vector<Component> sigma_components(const Calibration& calibration) {
  const BundleResult& bundle = calibration.bundle;
  using Pool = std::pair<View::Kind, Mount>;
  const auto pool_of = [&](const GroupSummary& group) {
    return Pool{group.kind, bundle.state.rig.sensors[group.sensor].mount};
  };
  std::map<Pool, double> redundancies;
  for (const GroupSummary& group : bundle.groups) redundancies[pool_of(group)] += group.redundancy;
  std::vector<Component> components;
  std::map<Pool, Component> small;
  for (std::size_t g = 0; g < bundle.groups.size(); ++g) {
    const GroupSummary& group = bundle.groups[g];
    if (!group.sigma_estimated || !(group.redundancy > 0)) continue;
    const bool own = group.redundancy >= BundleOptions{}.minimum_redundancy;
    Component& component = own ? components.emplace_back() : small[pool_of(group)];
    component.groups.push_back(g);
    component.coordinates += static_cast<double>(group.observations - group.outliers) * View::dimension_of(group.kind);
    component.redundancy += group.redundancy;
    component.effective = 1 / calibration.inflation.of(group.kind);
  }
  for (auto& [pool, component] : small) {
    component.effective *= redundancies.at(pool) / component.redundancy;
    components.push_back(component);
  }
  return components;
}

struct InflationComponent {
  std::vector<std::size_t> groups;
  double degrees_of_freedom = 0;
};

std::vector<InflationComponent> inflation_components(const Calibration& calibration) {
  std::map<View::Kind, InflationComponent> kinds;
  for (std::size_t g = 0; g < calibration.bundle.groups.size(); ++g) {
    const View::Kind kind = calibration.bundle.groups[g].kind;
    const double degrees = calibration.inflation.degrees_of_freedom(kind);
    if (!std::isfinite(degrees) || !(degrees > 0)) continue;
    kinds[kind].groups.push_back(g);
    kinds[kind].degrees_of_freedom = degrees;
  }
  std::vector<InflationComponent> components;
  for (const auto& [kind, component] : kinds) components.push_back(component);
  return components;
}

// N of some observations, by parameters among which C is block diagonal: the common ones, with the eliminated poses
// following them by -G', and what the poses are beside that. M, K_p and D_p of each pose p.
struct Information {
  Eigen::MatrixXd common;
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 6>> coupling;  // empty where the pose has none of the observations
  std::vector<Matrix6d> pose;
};

Information decoupled(const NormalEquations& part, const JointCovariance& covariance) {
  Information information{part.common(), {}, {}};
  for (std::size_t p = 0; p < part.eliminated().size(); ++p) {
    const PoseEquations& of_pose = part.eliminated()[p];
    information.pose.push_back(of_pose.information);
    information.coupling.emplace_back();
    if (of_pose.information.isZero(0)) continue;
    const auto& gain = covariance.gain(p);
    information.coupling.back() = of_pose.coupling - gain * of_pose.information;
    const Eigen::MatrixXd followed = gain * of_pose.coupling.transpose();
    information.common.noalias() -= followed;
    information.common.noalias() -= information.coupling.back() * gain.transpose();
  }
  return information;
}

class Informations {
 public:
  Informations(const Observations& observations, const Calibration& calibration, int threads)
      : observations_(observations), calibration_(calibration), threads_(threads) {}

  Information of(const std::vector<std::size_t>& groups) const {
    const BundleResult& bundle = calibration_.bundle;
    std::vector<std::unique_ptr<View>> views;
    std::vector<std::size_t> numbers;
    auto all = make_views(observations_, bundle.state.board_of);
    for (std::size_t v = 0; v < all.size(); ++v) {
      const bool among = std::any_of(groups.begin(), groups.end(), [&](std::size_t g) {
        return bundle.groups[g].sensor == all[v]->sensor() && bundle.groups[g].kind == all[v]->kind();
      });
      if (!among || !counted(calibration_, v)) continue;
      views.push_back(std::move(all[v]));
      numbers.push_back(v);
    }
    const auto part = NormalEquations::of(
        views, bundle.covariance.parameters(),
        [&](std::size_t i, ViewEvaluation& at) { return whitened_view(calibration_, *views[i], numbers[i], at); },
        threads_);
    // What counted was predicted.
    return decoupled(part.value(), bundle.covariance);
  }

 private:
  const Observations& observations_;
  const Calibration& calibration_;
  int threads_;
};

// tr(C N).
double trace(const Information& n, const JointCovariance& covariance) {
  double sum = n.common.cwiseProduct(covariance.common()).sum();
  for (std::size_t p = 0; p < n.pose.size(); ++p) sum += n.pose[p].cwiseProduct(covariance.pose_inverse(p)).sum();
  return sum;
}

// The common parameters' part of N_i C N_j, between the C on either side.
Eigen::MatrixXd product(const Information& i, const Information& j, const JointCovariance& covariance) {
  Eigen::MatrixXd sum = i.common * covariance.common() * j.common;
  for (std::size_t p = 0; p < i.pose.size(); ++p) {
    if (i.coupling[p].rows() == 0 || j.coupling[p].rows() == 0) continue;
    sum.noalias() += i.coupling[p] * covariance.pose_inverse(p) * j.coupling[p].transpose();
  }
  return sum;
}

// tr(C N_i C N_j), of which `common` is product(i, j).
double trace_of_product(const Information& i, const Information& j, const Eigen::MatrixXd& common,
                        const JointCovariance& covariance) {
  double sum = common.cwiseProduct(covariance.common()).sum();
  for (std::size_t p = 0; p < i.pose.size(); ++p) {
    if (i.coupling[p].rows() == 0 || j.coupling[p].rows() == 0) continue;
    const Matrix6d& pose = covariance.pose_inverse(p);
    const Matrix6d through = i.coupling[p].transpose() * covariance.common() * j.coupling[p];
    const Matrix6d own = i.pose[p] * pose * j.pose[p];
    sum += (through + own).cwiseProduct(pose).sum();
  }
  return sum;
}

// A matrix whose eigenvalues lie between these but for rounding.
Eigen::MatrixXd clipped(const Eigen::MatrixXd& matrix, double least, double most) {
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (matrix + matrix.transpose()));
  return eigen.vectors * eigen.values.cwiseMax(least).cwiseMin(most).asDiagonal() * eigen.vectors.transpose();
}

// F^-1, F to a unit diagonal bounded from below: variances that residuals cannot tell apart at all would be unknown.
Eigen::MatrixXd knowledge_of(const Eigen::MatrixXd& f) {
  constexpr double kLeastTold = 0.05;
  if (f.size() == 0) return f;
  const Eigen::VectorXd scale = f.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd equilibrated = scale.asDiagonal() * f * scale.asDiagonal();
  const auto most = static_cast<double>(f.rows());
  return scale.asDiagonal() * inverse_positive(clipped(equilibrated, kLeastTold, most)) * scale.asDiagonal();
}

// R R' = covariance, also where rounding has left it indefinite.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse = sigma.cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return sigma.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

void add_weighting(const Observations& observations, const BundleOptions& options, Calibration& calibration) {
  JointCovariance& covariance = calibration.bundle.covariance;
  const Informations informations(observations, calibration, options.threads);
  const std::vector<Component> components = sigma_components(calibration);
  const auto count = static_cast<Eigen::Index>(components.size());
  std::vector<Information> n;
  for (const Component& component : components) n.push_back(informations.of(component.groups));
  Eigen::MatrixXd f(count, count);
  std::vector<std::vector<Eigen::MatrixXd>> products(components.size());
  for (std::size_t i = 0; i < components.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      products[i].push_back(product(n[i], n[j], covariance));
      double entry = trace_of_product(n[i], n[j], products[i][j], covariance);
      if (i == j) entry += components[i].coordinates - 2 * trace(n[i], covariance);
      entry *= std::sqrt(components[i].effective * components[j].effective);
      f(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = entry;
      f(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = entry;
    }
  }
  const Eigen::MatrixXd knowledge = knowledge_of(f);
  const Eigen::Index size = covariance.common().rows();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < components.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double of_pair = knowledge(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (i == j) sum += 4 * of_pair * n[i].common;
      sum -= 4 * of_pair * products[i][j];
      if (i != j) sum -= 4 * of_pair * products[i][j].transpose();
    }
  }
  double gated = 0;
  const auto add_gate = [&](const std::vector<std::size_t>& groups, const Information& information) {
    double coordinates = 0, redundancy = 0;
    const View::Kind kind = calibration.bundle.groups[groups.front()].kind;
    for (const std::size_t g : groups) {
      const GroupSummary& group = calibration.bundle.groups[g];
      coordinates += static_cast<double>(group.observations - group.outliers) * View::dimension_of(kind);
      redundancy += group.redundancy;
    }
    if (!(redundancy > 0)) return;
    const double cost = cost_of_gate(View::dimension_of(kind), options.gate) * coordinates / redundancy /
                        calibration.inflation.of(kind);
    sum += cost * information.common;
    gated += cost;
  };
  std::set<std::size_t> estimated;
  for (std::size_t i = 0; options.reject_outliers && i < components.size(); ++i) {
    add_gate(components[i].groups, n[i]);
    estimated.insert(components[i].groups.begin(), components[i].groups.end());
  }
  for (std::size_t g = 0; options.reject_outliers && g < calibration.bundle.groups.size(); ++g) {
    if (!estimated.contains(g)) add_gate({g}, informations.of({g}));
  }
  VarianceEstimates& estimates = calibration.variances;
  estimates.of_group.resize(calibration.bundle.groups.size());
  for (std::size_t i = 0; i < components.size(); ++i) {
    for (const std::size_t g : components[i].groups) estimates.of_group[g] = i;
    estimates.shares.push_back(covariance.common() * n[i].common * covariance.common());
  }
  n.clear();
  const std::vector<InflationComponent> inflations = inflation_components(calibration);
  const Eigen::Index all = count + static_cast<Eigen::Index>(inflations.size());
  estimates.half_relative_covariance = Eigen::MatrixXd::Zero(all, all);
  estimates.half_relative_covariance.topLeftCorner(count, count) = knowledge;
  for (const InflationComponent& component : inflations) {
    const auto row = static_cast<Eigen::Index>(estimates.shares.size());
    estimates.half_relative_covariance(row, row) = 1 / component.degrees_of_freedom;
    const Information of_kind = informations.of(component.groups);
    estimates.shares.push_back(covariance.common() * of_kind.common * covariance.common());
    sum += 4 / component.degrees_of_freedom * (of_kind.common - product(of_kind, of_kind, covariance));
  }
  if (size == 0) return;
  // No part of information exceeds the whole: no term exceeds a quarter of its factor, the gate's none of theirs.
  const double most = estimates.half_relative_covariance.cwiseAbs().sum() + gated;
  const Eigen::MatrixXd root = root_of(covariance.common());
  covariance.widen(root * clipped(root.transpose() * sum * root, 0, most) * root.transpose());
}

}  // namespace crumple
