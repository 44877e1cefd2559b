// A scale bar: two LEDs at a certified distance, put down at one or several places before the trackers.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/certificate.h"
#include "solvers/prior.h"

namespace crumple {

struct ScaleBar {
  std::string name;
  std::vector<std::pair<std::size_t, std::size_t>> places;  // its ends at each place, two world LEDs of their own
  double length_mm = 0;
  BoardCertificate certificate = {};  // of the length in place of a pitch
  double placing_sigma_mm = 0;        // how well the bar keeps its length from place to place, standard deviation
};

// The bar's distances as a prior named after it. The certificate's error is common to all places, that of the placing
// is each one's own; it counts as a tenth of the certificate's at least, since no bar has exactly one length at two
// places, and rounded numbers could not hold it. The capture's temperature counts as in calib/certificate.h, apart from
// the boards'.
Prior bar_prior(const ScaleBar& bar, const std::optional<Temperature>& capture);

}  // namespace crumple
