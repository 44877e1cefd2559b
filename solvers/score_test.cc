#include "solvers/score_test.h"

#include <algorithm>
#include <cmath>

#include "solvers/decompositions.h"
#include "solvers/normal_equations.h"
#include "solvers/parallel.h"
#include "solvers/square_root.h"

namespace crumple {
namespace {

constexpr double kNotTestable = 1e-6;
constexpr double kBeyondNoise = 9;  // three sigma

// One over sigma, also for outliers that are near enough to be what a fault made.
Eigen::VectorXd weights_of_rows(const View& view, const ViewSummary& summary, double sigma_px, double inflation,
                                double most_sigmas) {
  const int d = view.dimension();
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(d * view.size(), 1 / (sigma_px * std::sqrt(inflation)));
  for (int i = 0; i < view.size(); ++i) {
    if (summary.inlier[static_cast<std::size_t>(i)]) continue;
    const bool near = d == 2 && summary.residuals_px.segment(d * i, d).norm() < most_sigmas * sigma_px;
    if (!near) weights.segment(d * i, d).setZero();
  }
  return weights;
}

}  // namespace

Expected<ScoreTester> ScoreTester::create(const Observations& observations, const BundleResult& result,
                                          const BundleOptions& options, double most_sigmas) {
  auto views = make_views(observations, result.state.board_of);
  std::vector<ViewEvaluation> evaluations(views.size());
  std::vector<Eigen::VectorXd> row_weights(views.size());
  std::vector<char> predicted(views.size(), 0);
  parallel_for(views.size(), options.threads, [&](std::size_t v) {
    predicted[v] = views[v]->evaluate(result.state, true, evaluations[v]);
    const ViewSummary& summary = result.views[v];
    const auto group = std::find_if(result.groups.begin(), result.groups.end(), [&](const GroupSummary& g) {
      return g.sensor == summary.sensor && g.kind == summary.kind;
    });
    row_weights[v] =
        weights_of_rows(*views[v], summary, group->sigma_px, inflation_of(summary.kind, options), most_sigmas);
  });
  if (std::count(predicted.begin(), predicted.end(), 0) > 0) return fail("an observation cannot be predicted");
  const Parameters& parameters = result.covariance.parameters();
  const NormalEquations::Evaluate whitened_at = [&](std::size_t v, ViewEvaluation& whitened) {
    whitened = evaluations[v];
    whitened.residuals = row_weights[v].cwiseProduct(whitened.residuals);
    whitened.jacobian = row_weights[v].asDiagonal() * whitened.jacobian;
    return true;
  };
  auto equations = NormalEquations::of(views, parameters, whitened_at, options.threads);
  for (const Prior& prior : options.priors) equations->add(prior, result.state);
  auto covariance = JointCovariance::create(*equations, result.state, [&] {
    return reduced_square_root(views, parameters, whitened_at, options.priors, result.state, options.threads);
  });
  if (!covariance) return tl::unexpected(covariance.error());
  ScoreTester tester(std::move(*covariance));
  Eigen::VectorXd reduced = equations->common_gradient();
  for (std::size_t p = 0; p < equations->eliminated().size(); ++p) {
    const Vector6d& gradient = equations->eliminated()[p].gradient;
    reduced.noalias() -= tester.covariance_.gain(p) * gradient;
    tester.step_poses_.push_back(tester.covariance_.pose_inverse(p) * gradient);
  }
  tester.step_common_ = tester.covariance_.common() * reduced;
  tester.views_ = std::move(views);
  tester.evaluations_ = std::move(evaluations);
  tester.row_weights_ = std::move(row_weights);
  return tester;
}

ScoreOutcome ScoreTester::test(const Columns& columns) const {
  if (columns.empty()) return {};
  const Eigen::Index q = columns.front().second.cols();
  const Parameters& parameters = covariance_.parameters();
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(q, q);                            // G'G
  Eigen::VectorXd score = Eigen::VectorXd::Zero(q);                             // G'r
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(parameters.common_size(), q);  // J'G of the common parameters
  std::map<std::size_t, Eigen::MatrixXd> poses;                                 // and of the poses
  double rows = 0, information_per_px2 = 0;
  for (const auto& [v, by_further] : columns) {
    const ViewEvaluation& at = evaluations_[v];
    const Eigen::MatrixXd g = row_weights_[v].asDiagonal() * by_further;
    own.noalias() += g.transpose() * g;
    score.noalias() += g.transpose() * row_weights_[v].cwiseProduct(at.residuals);
    const auto about = (g.rowwise().squaredNorm().array() > 0).cast<double>();
    rows += about.sum();
    information_per_px2 += (about * row_weights_[v].array().square()).sum();
    const Eigen::MatrixXd local = at.jacobian.transpose() * (row_weights_[v].asDiagonal() * g);
    const Eigen::MatrixXd by_blocks = at.local_from_blocks.transpose() * local;
    for (const Parameters::Span& span : parameters.spans(views_[v]->blocks())) {
      const auto part = by_blocks.middleRows(span.column, span.size);
      if (!span.slot) {
        common.middleRows(span.common_offset, span.size) += part;
      } else if (const auto [pose, fresh] = poses.try_emplace(*span.slot, part); !fresh) {
        pose->second += part;
      }
    }
  }
  // G'J H^-1 (J'G and J'r), through the Schur complement.
  Eigen::MatrixXd reduced = common;
  Eigen::MatrixXd followed = Eigen::MatrixXd::Zero(q, q);
  for (const auto& [slot, part] : poses) {
    reduced.noalias() -= covariance_.gain(slot) * part;
    followed.noalias() += part.transpose() * covariance_.pose_inverse(slot) * part;
    score.noalias() -= part.transpose() * step_poses_[slot];
  }
  followed.noalias() += reduced.transpose() * covariance_.common() * reduced;
  score.noalias() -= reduced.transpose() * step_common_;

  ScoreOutcome outcome{0, 0, Eigen::VectorXd::Zero(q), Eigen::VectorXd::Zero(q)};
  const Eigen::VectorXd scale = own.diagonal().cwiseSqrt().unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const SymmetricEigen parts = symmetric_eigen(scale.asDiagonal() * (own - followed) * scale.asDiagonal());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(q), beyond_noise = Eigen::VectorXd::Zero(q);
  for (Eigen::Index i = 0; i < q; ++i) {
    if (!(parts.values[i] > kNotTestable)) continue;
    const Eigen::VectorXd direction = scale.asDiagonal() * parts.vectors.col(i);
    const double along = direction.dot(score);
    outcome.gain += along * along / parts.values[i];
    outcome.estimate -= along / parts.values[i] * direction;
    if (along * along > kBeyondNoise * parts.values[i]) beyond_noise -= along / parts.values[i] * direction;
    variance += direction.cwiseAbs2() / parts.values[i];
    ++outcome.degrees;
  }
  outcome.sigma = variance.cwiseSqrt();
  outcome.bias = std::sqrt(std::max(0.0, beyond_noise.dot(followed * beyond_noise)));
  if (rows > 0) outcome.effect = std::sqrt(outcome.gain / rows);
  if (rows > 0) outcome.effect_px = std::sqrt(outcome.gain / information_per_px2);
  return outcome;
}

}  // namespace crumple
