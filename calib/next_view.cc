#include "calib/next_view.h"

#include <algorithm>
#include <limits>

#include "calib/volume_uncertainty.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

// What the candidate tells of the blocks, its own pose free; zero where it determines none.
Eigen::MatrixXd told_by(const ViewCandidate& candidate, const CalibrationData& data, const Calibration& calibration,
                        std::vector<BlockId> blocks, Eigen::Index rows) {
  const PredictedView view = predicted_view(candidate, data, calibration);
  const WeightOf usual = weights_of(calibration);
  const auto weights = [&](const View& of) {
    ViewWeights w = usual(of);
    if (of.kind() == View::Kind::stripes) w.inflation /= view.readings_each;
    if (of.kind() == View::Kind::features) w.inflation /= view.features_each;
    return w;
  };
  blocks.push_back(view.pose);
  const auto all = information(view.observations, view.state, weights, blocks);
  const auto told = all ? without_last(*all, 6) : std::nullopt;
  return told.value_or(Eigen::MatrixXd::Zero(rows, rows));
}

// The diagonal of D C D' after information Lambda, from that before.
Eigen::VectorXd variances_after(const Eigen::VectorXd& before, const Eigen::MatrixXd& d_covariance,
                                const Eigen::MatrixXd& gain) {
  return before - (d_covariance * gain).cwiseProduct(d_covariance).rowwise().sum();
}

}  // namespace

Expected<NextViews> next_views(const CalibrationData& data, const Calibration& calibration,
                               const std::vector<ViewCandidate>& candidates, int count, int threads) {
  const std::vector<BlockId> blocks = estimated_blocks(data, calibration);
  const auto volume = measuring_volume(data, calibration, blocks);
  if (!volume) return tl::unexpected(volume.error());
  Eigen::MatrixXd covariance = calibration.bundle.covariance.of(blocks, calibration.bundle.state);
  std::vector<Eigen::MatrixXd> told(candidates.size());
  parallel_for(candidates.size(), threads,
               [&](std::size_t c) { told[c] = told_by(candidates[c], data, calibration, blocks, covariance.rows()); });

  const Eigen::MatrixXd& derivative = volume->d_parameters;
  Eigen::VectorXd variances = (derivative * covariance).cwiseProduct(derivative).rowwise().sum();
  NextViews result{volume->triangulated, volume->mean_uncertainty(variances), {}};
  double uncertainty = result.now;
  while (static_cast<int>(result.suggestions.size()) < count) {
    const Eigen::MatrixXd d_covariance = derivative * covariance;
    std::vector<double> after(candidates.size(), std::numeric_limits<double>::infinity());
    parallel_for(candidates.size(), threads, [&](std::size_t c) {
      if (told[c].size() == 0) return;  // taken
      after[c] = volume->mean_uncertainty(variances_after(variances, d_covariance, gain_of(told[c], covariance)));
    });
    const auto best = std::min_element(after.begin(), after.end());
    if (best == after.end() || !(*best < uncertainty)) break;
    const auto c = static_cast<std::size_t>(best - after.begin());
    const Eigen::MatrixXd gain = gain_of(told[c], covariance);
    variances = variances_after(variances, d_covariance, gain);
    covariance -= covariance * gain * covariance;
    told[c].resize(0, 0);
    result.suggestions.push_back({candidates[c], uncertainty, *best});
    uncertainty = *best;
  }
  return result;
}

Expected<NextViews> next_views(const CalibrationData& data, const Calibration& calibration, int count, int threads) {
  const auto candidates = count > 0 ? view_candidates(data, calibration) : std::vector<ViewCandidate>();
  return next_views(data, calibration, candidates, count, threads);
}

}  // namespace crumple
