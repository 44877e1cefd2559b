#include "calib/scale_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr const char* kOfEarlier = "it is the earlier rig's, which does not record what it lacks";
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

std::vector<MeasuredScale> measured_scales(const CalibrationData& data, const BundleResult& bundle) {
  std::set<std::string> undetermined;
  for (const Undetermined& direction : bundle.undetermined) {
    if (direction.prior == kWeakScale) undetermined.insert(direction.terms.begin(), direction.terms.end());
  }
  std::vector<MeasuredScale> scales;
  for (const std::size_t b : used(data.board_of)) {
    const BlockId block = scale_of(b).block;
    const double variance = bundle.covariance.of({block}, bundle.state)(0, 0);
    if (data.boards[b].certificate || !(variance > 0)) continue;
    scales.push_back({b, bundle.state.boards[b].scale, std::sqrt(variance),
                      !undetermined.contains(parameter_names(block, bundle.state).front())});
  }
  return scales;
}

std::optional<ScaleUncertainty> scale_uncertainty(const CalibrationData& data, const BundleResult& bundle) {
  std::vector<std::string> missing;  // of each certificate
  for (const std::size_t b : used(data.board_of)) {
    if (data.boards[b].certificate) missing.push_back(missing_in(*data.boards[b].certificate, data.temperature));
  }
  for (const ScaleBar& bar : data.bars) missing.push_back(missing_in(bar.certificate, data.temperature));
  if (missing.empty() || data.board_of.empty()) return std::nullopt;
  ScaleUncertainty largest;
  for (const std::string& lacks : missing) {
    if (largest.missing.empty()) largest.missing = lacks;
  }
  for (const std::size_t b : used(data.board_of)) {
    const double variance = bundle.covariance.of({scale_of(b).block}, bundle.state)(0, 0);
    largest.relative = std::max(largest.relative, std::sqrt(variance));
  }
  return largest;
}

std::optional<ScaleUncertainty> scale_uncertainty(const RigCovariance& covariance) {
  std::optional<ScaleUncertainty> largest;
  for (std::size_t i = 0; i < covariance.names.size(); ++i) {
    if (!covariance.names[i].ends_with(".scale")) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double relative = std::sqrt(covariance.matrix(row, row));
    if (!largest || relative > largest->relative) largest = {relative, kOfEarlier};
  }
  return largest;
}

}  // namespace crumple
