#include "calib/alternatives.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "calib/alternative_candidates.h"
#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

constexpr double kByChance = 1e-3;    // over all that are tested
constexpr double kMaterial = 0.3;     // sigmas of observations
constexpr double kMaterialBias = 3;   // sigmas of parameters
constexpr double kFourOfFive = 0.84;  // of a normal distribution lie above minus so many sigmas
constexpr int kMostFound = 3;
constexpr double kEquallyGood = 9;  // of the sum of squares: 3 sigma

// Side by side over the views of either.
ScoreTester::Columns beside(const ScoreTester::Columns& left, const ScoreTester::Columns& right) {
  if (left.empty()) return right;
  const Eigen::Index of_left = left.front().second.cols(), of_right = right.front().second.cols();
  std::map<std::size_t, Eigen::MatrixXd> joined;
  const auto add = [&](const ScoreTester::Columns& columns, Eigen::Index first) {
    for (const auto& [v, matrix] : columns) {
      auto& all = joined.try_emplace(v, Eigen::MatrixXd::Zero(matrix.rows(), of_left + of_right)).first->second;
      all.middleCols(first, matrix.cols()) = matrix;
    }
  };
  add(left, 0);
  add(right, of_left);
  return {joined.begin(), joined.end()};
}

double observation_count(const BundleResult& bundle) {
  double count = 0;
  for (const GroupSummary& group : bundle.groups) count += static_cast<double>(group.observations);
  return count;
}

struct Tested {
  std::size_t candidate = 0;
  ScoreOutcome outcome;  // of the candidate beside what was found before
  double gain = 0;       // more than without it
  int degrees = 0;
};

// The candidate's own part of an outcome that has others before it.
ScoreOutcome own_part(const ScoreOutcome& joint, Eigen::Index before, const ScoreOutcome& alone) {
  ScoreOutcome own = alone;
  own.estimate = joint.estimate.tail(joint.estimate.size() - before);
  own.sigma = joint.sigma.tail(joint.sigma.size() - before);
  return own;
}

// `inflation`: of the variance of the parameters, for correlated observations.
bool matters(const Tested& tested, AlternativeKind kind, std::size_t count, double inflation) {
  const bool of_board = kind == AlternativeKind::size || kind == AlternativeKind::shape;
  if (!of_board && tested.outcome.effect_px < kExactEnough_px) return false;
  const bool material =
      tested.outcome.effect >= kMaterial || tested.outcome.bias >= kMaterialBias * std::sqrt(inflation);
  return tested.degrees > 0 && material &&
         chi_square_tail(tested.gain, tested.degrees) < kByChance / static_cast<double>(count);
}

// Others that explain as much: which of two boards has the wrong pitch cannot be told.
std::string or_else(const std::vector<AlternativeCandidate>& candidates, const std::vector<Tested>& all,
                    const Tested& best) {
  const AlternativeCandidate& chosen = candidates[best.candidate];
  std::string others;
  for (const Tested& other : all) {
    const AlternativeCandidate& candidate = candidates[other.candidate];
    if (candidate.kind != chosen.kind || candidate.subject == chosen.subject) continue;
    if (other.degrees != best.degrees || other.gain < best.gain - kEquallyGood) continue;
    if (others.find(candidate.subject) == std::string::npos) others += "; or it is " + candidate.subject;
  }
  return others;
}

}  // namespace

Expected<AlternativeTests> test_alternatives(const CalibrationData& data, const Calibration& calibration, int threads) {
  const BundleOptions options{.priors = calibration.priors, .threads = threads};
  const auto tester = ScoreTester::create(data.observations, calibration.bundle, options);
  if (!tester) return tl::unexpected(tester.error());
  const std::vector<AlternativeCandidate> candidates = alternative_candidates(data, calibration, *tester);
  AlternativeTests result;
  result.tested = static_cast<int>(candidates.size());
  if (candidates.empty()) return result;
  const double per_degree = std::log(std::max(2.0, observation_count(calibration.bundle)));

  const double inflation = std::max(calibration.inflation.corners, calibration.inflation.stripes);
  // Sigmas of one parameter.
  const double least_found = std::sqrt(chi_square_exceeded(kByChance / static_cast<double>(candidates.size()), 1));
  std::vector<Tested> promising;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const ScoreOutcome outcome = tester->test(candidates[c].columns);
    if (candidates[c].kind == AlternativeKind::size && candidates[c].columns.front().second.cols() == 1) {
      if (outcome.degrees == 0) {
        result.untestable_sizes.push_back(candidates[c].subject);
      } else {
        result.size_limits.push_back({candidates[c].subject, outcome.sigma[0] * (least_found + kFourOfFive)});
      }
    }
    std::vector<std::string>& lenses = result.tested_lenses;
    if (candidates[c].kind == AlternativeKind::lens && outcome.degrees > 0 &&
        std::find(lenses.begin(), lenses.end(), candidates[c].subject) == lenses.end()) {
      lenses.push_back(candidates[c].subject);
    }
    Tested tested{c, outcome, outcome.gain, outcome.degrees};
    if (matters(tested, candidates[c].kind, candidates.size(), inflation)) promising.push_back(std::move(tested));
  }
  ScoreTester::Columns found_columns;
  ScoreOutcome found;
  while (!promising.empty() && static_cast<int>(result.found.size()) < kMostFound) {
    const auto best = std::max_element(promising.begin(), promising.end(), [&](const Tested& a, const Tested& b) {
      return a.gain - per_degree * a.degrees < b.gain - per_degree * b.degrees;
    });
    const AlternativeCandidate& chosen = candidates[best->candidate];
    result.found.push_back({chosen.kind, chosen.subject,
                            chosen.sentence(best->outcome) + or_else(candidates, promising, *best), best->gain,
                            best->degrees, best->outcome.effect, best->outcome.bias});
    found_columns = beside(found_columns, chosen.columns);
    found = tester->test(found_columns);
    std::vector<Tested> left;
    for (const Tested& before : promising) {
      const AlternativeCandidate& candidate = candidates[before.candidate];
      if (candidate.kind == chosen.kind && candidate.subject == chosen.subject) continue;
      const ScoreOutcome joint = tester->test(beside(found_columns, candidate.columns));
      Tested tested{before.candidate, own_part(joint, found.estimate.size(), before.outcome), joint.gain - found.gain,
                    joint.degrees - found.degrees};
      // What it matters beside what was found shrinks with its gain.
      const double less = std::sqrt(std::max(0.0, tested.gain) / std::max(1e-12, before.gain));
      tested.outcome.effect *= less;
      tested.outcome.effect_px *= less;
      tested.outcome.bias *= less;
      if (matters(tested, candidate.kind, candidates.size(), inflation)) left.push_back(std::move(tested));
    }
    promising = std::move(left);
  }
  for (const Tested& left : promising) {
    const AlternativeCandidate& candidate = candidates[left.candidate];
    std::vector<std::string>& lenses = result.further_lenses;
    if (candidate.kind != AlternativeKind::lens) continue;
    if (std::find(lenses.begin(), lenses.end(), candidate.subject) == lenses.end()) lenses.push_back(candidate.subject);
  }
  return result;
}

}  // namespace crumple
