#include "calib/certificate.h"

#include <fmt/format.h>

namespace crumple {

ScalePrior scale_prior(const BoardCertificate& certificate, double pitch_mm,
                       const std::optional<Temperature>& capture) {
  const double certified = certificate.pitch_sigma_mm / pitch_mm;
  if (!capture || !certificate.expansion_per_k) return {1, certified, 0};
  const double warmer_k = capture->celsius - certificate.temperature_c;
  const double by_temperature = *certificate.expansion_per_k * capture->sigma_k;
  const double by_expansion = warmer_k * certificate.expansion_sigma_per_k.value_or(0);
  return {1 + *certificate.expansion_per_k * warmer_k, std::hypot(certified, by_expansion), by_temperature};
}

std::vector<std::string> missing_in(const BoardCertificate& certificate, const std::string& owner,
                                    const std::optional<Temperature>& capture) {
  std::vector<std::string> missing;
  const bool as_certified = capture && capture->celsius == certificate.temperature_c;
  if (!certificate.expansion_per_k) {
    missing.push_back(fmt::format("the thermal expansion of {} is not stated", owner));
  } else if (!certificate.expansion_sigma_per_k && !as_certified) {
    missing.push_back(fmt::format("the standard uncertainty of the thermal expansion of {} is not stated", owner));
  }
  if (!capture) missing.emplace_back("the temperature during the calibration is not stated");
  return missing;
}

}  // namespace crumple
