#include "tracking/hand_eye_refinement.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "solvers/small_problem.h"
#include "tracking/hand_eye_noise.h"
#include "tracking/median.h"
#include "tracking/serial_correlation.h"

namespace crumple {
namespace {

constexpr double kGate = 25;
constexpr double kMedianOfSix = 5.348;
constexpr std::size_t kFewestPairs = 3;
constexpr std::size_t kPairsForCorrelation = 30;
constexpr int kRounds = 30;
constexpr double kStill = 1e-4;  // relative change of the noise

using Parameters = Eigen::Matrix<double, kHandEyeParameters, 1>;

HandEyeState moved(const HandEyeState& from, const Eigen::VectorXd& x) {
  return {retract(from.hand_from_eye, x.head<6>()), retract(from.world_from_board, x.segment<6>(6)),
          from.offset_s + (x.size() > 12 ? x[12] : 0.0)};
}

class Rounds {
 public:
  Rounds(const PairSource& source, const HandEyeState& start) : source_(source), state_(start) {}

  Expected<HandEyeFit> run() {
    if (!measure()) return fail("fewer than three poses of hand and eye stand at the same times");
    noise_ = robust_noise(residuals_);
    accept();
    for (int round = 0; round < kRounds; ++round) {
      if (accepted_count() < kFewestPairs) return fail("fewer than three pairs of poses agree with each other");
      auto solution = solve_round();
      if (!solution) return fail("the poses do not determine the hand-eye pose: " + solution.error().message);
      state_ = moved(state_, solution->x);
      solution_ = std::move(*solution);
      if (!measure()) return fail("the time offset left the streams' common time");
      const HandEyeNoise before = noise_;
      noise_ = most_likely_noise(accepted_residuals());
      const bool same = accept();
      if (same && std::abs(noise_.rotation_rad / before.rotation_rad - 1) < kStill &&
          std::abs(noise_.position_mm / before.position_mm - 1) < kStill) {
        break;
      }
    }
    return result();
  }

 private:
  // Residuals of all pairs that there are at the offset, and a step of time to either side: the fit moves it.
  bool measure() {
    const std::vector<std::size_t> before = indices_;
    const std::vector<char> were = accepted_;
    pairs_.clear();
    residuals_.clear();
    indices_.clear();
    accepted_.clear();
    for (std::size_t i = 0; i < source_.size; ++i) {
      const auto pair = source_.pair(i, state_.offset_s);
      if (!pair) continue;
      const auto known = std::lower_bound(before.begin(), before.end(), i);
      accepted_.push_back(known != before.end() && *known == i ? were[known - before.begin()] : 0);
      indices_.push_back(i);
      pairs_.push_back(*pair);
      residuals_.push_back(residual_of(*pair, state_));
    }
    return pairs_.size() >= kFewestPairs;
  }

  WhiteResidual white(std::size_t i) const { return whitened(residuals_[i], noise_, residuals_[i].lever_mm); }

  // True where the rule accepts the same pairs as before.
  bool accept() {
    std::vector<double> squares;
    for (std::size_t i = 0; i < residuals_.size(); ++i) squares.push_back(white(i).value.squaredNorm());
    const double few = 1 + 5 / std::max(1.0, static_cast<double>(squares.size()) - 2);
    const double limit = kGate * few * few * median_of(squares) / kMedianOfSix;
    std::vector<char> now;
    for (const double square : squares) now.push_back(square <= limit ? 1 : 0);
    const bool same = now == accepted_;
    accepted_ = now;
    return same;
  }

  std::size_t accepted_count() const {
    return static_cast<std::size_t>(std::count(accepted_.begin(), accepted_.end(), 1));
  }

  std::vector<HandEyeResidual> accepted_residuals() const {
    std::vector<HandEyeResidual> accepted;
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      if (accepted_[i] != 0) accepted.push_back(residuals_[i]);
    }
    return accepted;
  }

  int parameters() const { return source_.timed ? kHandEyeParameters : kHandEyeParameters - 1; }

  bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) const {
    const HandEyeState at = moved(state_, x);
    // The parameters are rotation vectors from the state; the Jacobians want turns of where that leads.
    Eigen::Matrix<double, kHandEyeParameters, kHandEyeParameters> chain;
    chain.setIdentity();
    chain.topLeftCorner<3, 3>() = left_jacobian(x.head<3>());
    chain.block<3, 3>(6, 6) = left_jacobian(x.segment<3>(6));
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (accepted_[i] == 0) continue;
      const auto pair = source_.pair(indices_[i], at.offset_s);
      if (!pair) return false;
      const WhiteResidual white = whitened(residual_of(*pair, at), noise_, residuals_[i].lever_mm);
      residuals.segment<6>(row) = white.value;
      if (jacobian != nullptr) jacobian->middleRows<6>(row) = (white.jacobian * chain).leftCols(parameters());
      row += 6;
    }
    return true;
  }

  Expected<SmallSolution> solve_round() const {
    SmallProblem problem;
    problem.residuals = 6 * static_cast<int>(accepted_count());
    problem.evaluate = [this](const Eigen::VectorXd& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) {
      return evaluate(x, residuals, jacobian);
    };
    return solve(problem, Eigen::VectorXd::Zero(parameters()), {.sigma = {}, .max_iterations = 100});
  }

  HandEyeFit result() const {
    HandEyeFit fit;
    fit.state = state_;
    fit.timed = source_.timed;
    fit.noise = noise_;
    fit.pairs = pairs_;
    fit.accepted = accepted_;
    fit.covariance.setZero();
    Eigen::MatrixXd covariance = solution_.covariance;
    if (source_.timed && accepted_count() >= kPairsForCorrelation) {
      covariance = correlated(covariance / (solution_.sigma * solution_.sigma));
      fit.correlation_inflation =
          std::max(1.0, (covariance.diagonal().array() / solution_.covariance.diagonal().array()).maxCoeff());
    }
    fit.covariance.topLeftCorner(parameters(), parameters()) = covariance;
    return fit;
  }

  Eigen::MatrixXd correlated(const Eigen::MatrixXd& inverse_information) const {
    const auto count = static_cast<Eigen::Index>(accepted_count());
    Eigen::MatrixXd residuals(count, 6), scores(count, parameters());
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < residuals_.size(); ++i) {
      if (accepted_[i] == 0) continue;
      const WhiteResidual w = white(i);
      residuals.row(row) = w.value.transpose();
      scores.row(row++) = (w.jacobian.transpose() * w.value).head(parameters()).transpose();
    }
    return serial_covariance(inverse_information, scores, correlation_reach(residuals));
  }

  const PairSource& source_;
  HandEyeState state_;
  HandEyeNoise noise_;
  std::vector<PosePair> pairs_;
  std::vector<std::size_t> indices_;  // of pairs_ in the source
  std::vector<HandEyeResidual> residuals_;
  std::vector<char> accepted_;
  SmallSolution solution_;
};

}  // namespace

Expected<HandEyeFit> refine_hand_eye(const PairSource& source, const HandEyeState& start) {
  return Rounds(source, start).run();
}

}  // namespace crumple
