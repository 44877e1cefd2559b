#include "calib/scale_bar.h"

#include <algorithm>

namespace crumple {
namespace {

constexpr double kLeastPlacing = 0.1;  // of the certificate's uncertainty

}  // namespace

Prior bar_prior(const ScaleBar& bar, const std::optional<Temperature>& capture) {
  const ScalePrior scale = scale_prior(bar.certificate, bar.length_mm, capture);
  const double common_mm = scale.sigma() * bar.length_mm;
  const double placing_mm = std::max(bar.placing_sigma_mm, kLeastPlacing * common_mm);
  std::vector<LedDistance> distances;
  for (const auto& [from, to] : bar.places) distances.push_back({from, to, scale.scale * bar.length_mm});
  const auto count = static_cast<Eigen::Index>(distances.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(count, count, common_mm * common_mm);
  covariance.diagonal().array() += placing_mm * placing_mm;
  return Prior::of_distances(bar.name, std::move(distances), covariance).value();
}

}  // namespace crumple
