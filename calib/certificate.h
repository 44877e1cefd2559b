// What is known of a board's size and flatness, and the priors that follow (GUM type B).
//
// Images alone cannot tell a board's scale. A certificate can: the mean pitch with its standard uncertainty at a
// temperature. At the capture's temperature T the true pitch is the nominal one times
//   scale = 1 + alpha (T - T0),   u^2 = (u_pitch / pitch)^2 + (alpha u_T)^2 + ((T - T0) u_alpha)^2,
// see calib/scale_uncertainty.h. What is not known is said, never taken for zero: an expansion, its standard
// uncertainty and the capture's temperature are missing where they are not stated. The uncertainty of the expansion is
// not missed where T = T0: it has no part in the scale there, however large it is.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace crumple {

struct BoardCertificate {
  double pitch_sigma_mm = 0;  // standard uncertainty of the mean pitch at `temperature_c`
  double temperature_c = 20;
  std::optional<double> expansion_per_k = {};
  std::optional<double> expansion_sigma_per_k = {};  // zero only where that is stated
  std::optional<double> flatness_mm = {};            // the surface lies between two planes this far apart
  // For the record.
  std::string serial = {};
  std::string issuer = {};
  std::string date = {};
};

struct Temperature {
  double celsius = 20;
  double sigma_k = 0;
};

struct ScalePrior {
  double scale = 1;
  double own_sigma = 0;          // by the certificate: pitch and expansion
  double temperature_sigma = 0;  // by the capture's temperature, common to all boards; signed as the expansion is
  double sigma() const { return std::hypot(own_sigma, temperature_sigma); }
};

// `capture` and the expansion are needed together: without either the scale is the certificate's, at its temperature.
ScalePrior scale_prior(const BoardCertificate& certificate, double pitch_mm, const std::optional<Temperature>& capture);

// What the prior does not contain, in words that name `owner`, such as "board 'large'"; empty where it is complete.
std::vector<std::string> missing_in(const BoardCertificate& certificate, const std::string& owner,
                                    const std::optional<Temperature>& capture);

}  // namespace crumple
