#include "calib/scale_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace crumple {
namespace {

constexpr double kWithoutCertificate = 0.05;  // of its size

std::set<std::size_t> used(const std::vector<std::size_t>& board_of) { return {board_of.begin(), board_of.end()}; }

PriorTerm scale_of(std::size_t board) { return {{BlockId::Kind::scale, board}, 0}; }

}  // namespace

std::vector<Prior> scale_priors(const std::vector<BoardSpec>& boards, const std::vector<std::size_t>& board_of,
                                const std::optional<Temperature>& capture, const CalibrationState& start) {
  std::vector<PriorTerm> certified, uncertified;
  std::vector<ScalePrior> scales;
  for (const std::size_t b : used(board_of)) {
    const BoardSpec& board = boards[b];
    (board.certificate ? certified : uncertified).push_back(scale_of(b));
    if (board.certificate) scales.push_back(scale_prior(*board.certificate, board.target.pitch_mm, capture));
  }
  if (certified.empty()) return {};
  const auto count = static_cast<Eigen::Index>(scales.size());
  Eigen::VectorXd own(count), by_temperature(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    own[i] = scales[static_cast<std::size_t>(i)].own_sigma;
    by_temperature[i] = scales[static_cast<std::size_t>(i)].temperature_sigma;
  }
  Eigen::MatrixXd covariance = by_temperature * by_temperature.transpose();
  covariance.diagonal() += own.cwiseAbs2();
  std::vector<Prior> priors = {Prior::create("certificates", std::move(certified), start, covariance).value()};
  if (!uncertified.empty()) {
    const auto others = static_cast<Eigen::Index>(uncertified.size());
    const Eigen::MatrixXd wide = kWithoutCertificate * kWithoutCertificate * Eigen::MatrixXd::Identity(others, others);
    priors.push_back(Prior::create("scale.weak", std::move(uncertified), start, wide).value().as_weak());
  }
  return priors;
}

std::optional<ScaleUncertainty> scale_uncertainty(const std::vector<BoardSpec>& boards,
                                                  const std::vector<std::size_t>& board_of,
                                                  const std::optional<Temperature>& capture,
                                                  const BundleResult& bundle) {
  std::optional<ScaleUncertainty> largest;
  for (const std::size_t b : used(board_of)) {
    if (!boards[b].certificate) continue;
    if (!largest) largest = ScaleUncertainty{};
    if (largest->missing.empty()) largest->missing = missing_in(*boards[b].certificate, capture);
  }
  if (!largest) return std::nullopt;
  for (const std::size_t b : used(board_of)) {
    const double variance = bundle.covariance.of({scale_of(b).block}, bundle.state)(0, 0);
    largest->relative = std::max(largest->relative, std::sqrt(variance));
  }
  return largest;
}

}  // namespace crumple
