// All orientations of a station, decoded to pixel-wise stripe coordinates: what calibration and reconstruction share.
#pragma once

#include <vector>

#include "recon/decode.h"
#include "recon/stripe_phase.h"
#include "solvers/expected.h"

namespace crumple {

// One result per orientation, in their order. Fails where the images do not fit each other or the bit rule.
Expected<std::vector<StripeCoordinates>> read_stripes(const StripeImages& images, const DecodeOptions& decode,
                                                      const PhaseOptions& phase);

}  // namespace crumple
