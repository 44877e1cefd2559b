#include "calib/kept_parts.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "calib/whitened_view.h"
#include "solvers/decompositions.h"
#include "solvers/normal_equations.h"
#include "solvers/rig_covariance.h"
#include "solvers/square_root.h"

namespace crumple {
namespace {

// Of what was kept the blocks that the earlier rig has a covariance of; the others, such as the frames' own mounts, are
// exact.
std::set<BlockId> uncertain_ones(const std::set<BlockId>& kept, const Calibration& calibration) {
  std::set<BlockId> uncertain;
  for (const BlockId& block : kept) {
    const std::string first = parameter_names(block, calibration.bundle.state).front();
    if (find_row(calibration.earlier->rig.covariance, first)) uncertain.insert(block);
  }
  return uncertain;
}

// All that the refinement did not estimate, but for what was kept.
std::set<BlockId> still_held(const std::vector<std::unique_ptr<View>>& views, const Calibration& calibration,
                             const std::set<BlockId>& kept) {
  std::set<BlockId> held;
  const auto hold = [&](const std::vector<BlockId>& blocks) {
    for (const BlockId& block : blocks) {
      if (!kept.contains(block) && !calibration.bundle.covariance.parameters().estimated(block)) held.insert(block);
    }
  };
  for (const auto& view : views) hold(view->blocks());
  for (const Prior& prior : calibration.priors) hold(prior.blocks());
  return held;
}

}  // namespace

Expected<JointCovariance> covariance_with_kept(const Observations& observations, const Calibration& calibration,
                                               const std::set<BlockId>& all_kept, int threads) {
  const BundleResult& bundle = calibration.bundle;
  const std::set<BlockId> kept = uncertain_ones(all_kept, calibration);
  std::vector<std::unique_ptr<View>> views;
  std::vector<std::size_t> numbers;
  auto all = make_views(observations, bundle.state.board_of);
  for (std::size_t v = 0; v < all.size(); ++v) {
    if (!counted(calibration, v)) continue;
    views.push_back(std::move(all[v]));
    numbers.push_back(v);
  }
  const Parameters parameters(bundle.state, views, still_held(views, calibration, kept), calibration.priors);
  const NormalEquations::Evaluate whitened = [&](std::size_t i, ViewEvaluation& at) {
    return whitened_view(calibration, *views[i], numbers[i], at);
  };
  NormalEquations equations = NormalEquations::of(views, parameters, whitened, threads).value();  // all was predicted
  for (const Prior& prior : calibration.priors) equations.add(prior, bundle.state);
  auto covariance = JointCovariance::create(equations, bundle.state, [&] {
    return reduced_square_root(views, parameters, whitened, calibration.priors, bundle.state, threads);
  });
  if (!covariance) return covariance;

  const std::vector<std::string>& names = covariance->names();
  std::vector<std::string> kept_names;
  std::vector<Eigen::Index> rows;
  for (const BlockId& block : kept) {
    for (const std::string& name : parameter_names(block, bundle.state)) {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) continue;  // a lens that is another's
      kept_names.push_back(name);
      rows.push_back(std::distance(names.begin(), found));
    }
  }
  const Eigen::MatrixXd of_kept = covariance->common()(rows, rows);
  const Eigen::MatrixXd before = covariance_of(calibration.earlier->rig.covariance, kept_names);
  const Eigen::MatrixXd followed = solve_symmetric(of_kept, covariance->common()(rows, Eigen::all)).transpose();  // M
  Eigen::MatrixXd by = followed * (before - of_kept) * followed.transpose();

  const Eigen::MatrixXd& widening = bundle.covariance.widening();
  std::vector<Eigen::Index> corrected;
  for (const std::string& name : bundle.covariance.names()) {
    corrected.push_back(std::distance(names.begin(), std::find(names.begin(), names.end(), name)));
  }
  if (widening.size() > 0) by(corrected, corrected) += widening;
  covariance->widen(0.5 * (by + by.transpose()));
  return covariance;
}

}  // namespace crumple
