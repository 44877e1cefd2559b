#include "calib/certificate.h"

namespace crumple {

ScalePrior scale_prior(const BoardCertificate& certificate, double pitch_mm,
                       const std::optional<Temperature>& capture) {
  const double certified = certificate.pitch_sigma_mm / pitch_mm;
  if (!capture || !certificate.expansion_per_k) return {1, certified, 0};
  const double warmer_k = capture->celsius - certificate.temperature_c;
  const double by_temperature = *certificate.expansion_per_k * capture->sigma_k;
  const double by_expansion = warmer_k * certificate.expansion_sigma_per_k;
  return {1 + *certificate.expansion_per_k * warmer_k, std::hypot(certified, by_expansion), by_temperature};
}

std::string missing_in(const BoardCertificate& certificate, const std::optional<Temperature>& capture) {
  if (!certificate.expansion_per_k) return "a certificate's thermal expansion is not stated";
  if (!capture) return "the temperature during the capture is not stated";
  return {};
}

}  // namespace crumple
