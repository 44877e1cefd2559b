#include "calib/scale_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "solvers/parameters.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

constexpr double kWithoutCertificate = 0.05;  // of its size

std::set<std::size_t> used(const std::vector<std::size_t>& board_of) { return {board_of.begin(), board_of.end()}; }

PriorTerm scale_of(std::size_t board) { return {{BlockId::Kind::scale, board}, 0}; }

}  // namespace

std::vector<Prior> scale_priors(const CalibrationData& data, const CalibrationState& start) {
  std::vector<PriorTerm> certified, uncertified;
  std::vector<ScalePrior> scales;
  for (const std::size_t b : used(data.board_of)) {
    const BoardSpec& board = data.boards[b];
    (board.certificate ? certified : uncertified).push_back(scale_of(b));
    if (board.certificate) scales.push_back(scale_prior(*board.certificate, board.target.pitch_mm, data.temperature));
  }
  if (certified.empty() && data.bars.empty()) return {};
  std::vector<Prior> priors;
  for (const ScaleBar& bar : data.bars) priors.push_back(bar_prior(bar, data.temperature));
  if (!certified.empty()) {
    const auto count = static_cast<Eigen::Index>(scales.size());
    Eigen::VectorXd own(count), by_temperature(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      own[i] = scales[static_cast<std::size_t>(i)].own_sigma;
      by_temperature[i] = scales[static_cast<std::size_t>(i)].temperature_sigma;
    }
    Eigen::MatrixXd covariance = by_temperature * by_temperature.transpose();
    covariance.diagonal() += own.cwiseAbs2();
    priors.push_back(Prior::create("certificates", std::move(certified), start, covariance).value());
  }
  if (!uncertified.empty()) {
    const auto others = static_cast<Eigen::Index>(uncertified.size());
    const Eigen::MatrixXd wide = kWithoutCertificate * kWithoutCertificate * Eigen::MatrixXd::Identity(others, others);
    priors.push_back(Prior::create(kWeakScale, std::move(uncertified), start, wide).value().as_weak());
  }
  return priors;
}

std::vector<MeasuredScale> measured_scales(const CalibrationData& data, const BundleResult& bundle,
                                           const JointCovariance& covariance) {
  std::set<std::string> undetermined;
  for (const Undetermined& direction : bundle.undetermined) {
    if (direction.prior == kWeakScale) undetermined.insert(direction.terms.begin(), direction.terms.end());
  }
  std::vector<MeasuredScale> scales;
  for (const std::size_t b : used(data.board_of)) {
    const BlockId block = scale_of(b).block;
    const double variance = covariance.of({block}, bundle.state)(0, 0);
    if (data.boards[b].certificate || !(variance > 0)) continue;
    scales.push_back({b, bundle.state.boards[b].scale, std::sqrt(variance),
                      !undetermined.contains(parameter_names(block, bundle.state).front())});
  }
  return scales;
}

std::vector<std::string> scale_lacks(const CalibrationData& data, std::vector<std::string> known) {
  const auto add = [&](const BoardCertificate& certificate, const std::string& owner) {
    for (std::string& lack : missing_in(certificate, owner, data.temperature)) {
      if (std::find(known.begin(), known.end(), lack) == known.end()) known.push_back(std::move(lack));
    }
  };
  for (const std::size_t b : used(data.board_of)) {
    const BoardSpec& board = data.boards[b];
    if (board.certificate) add(*board.certificate, fmt::format("board '{}'", board.name));
  }
  for (const ScaleBar& bar : data.bars) add(bar.certificate, fmt::format("scale bar '{}'", bar.name));
  return known;
}

std::optional<ScaleUncertainty> scale_uncertainty(const CalibrationData& data, const CalibrationState& state,
                                                  const JointCovariance& covariance) {
  const std::set<std::size_t> boards = used(data.board_of);
  const bool certified =
      std::any_of(boards.begin(), boards.end(), [&](std::size_t b) { return data.boards[b].certificate.has_value(); });
  if (boards.empty() || (!certified && data.bars.empty())) return std::nullopt;
  ScaleUncertainty largest{0, scale_lacks(data)};
  for (const std::size_t b : boards) {
    const double variance = covariance.of({scale_of(b).block}, state)(0, 0);
    largest.relative = std::max(largest.relative, std::sqrt(variance));
  }
  return largest;
}

std::optional<ScaleUncertainty> scale_uncertainty(const RigCovariance& covariance) {
  std::optional<ScaleUncertainty> largest;
  for (std::size_t i = 0; i < covariance.names.size(); ++i) {
    if (!is_scale(covariance.names[i])) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double relative = std::sqrt(covariance.matrix(row, row));
    if (!largest || relative > largest->relative) largest = ScaleUncertainty{relative};
  }
  return largest;
}

}  // namespace crumple
