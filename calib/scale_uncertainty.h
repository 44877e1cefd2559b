// How sure the scale of a calibration is, and what that means for the rig.
//
// Images tell a calibration up to its scale, which is the boards' alone: stretch boards, mounts and placements together
// and no residual changes. So nothing but the certificate determines it, and joining it to the refinement as a
// parameter under its prior gives, exactly, what is done here: with v the derivative of the rig by the scale (a mount's
// translation and a board's warp are their own derivatives, all else is zero),
//   covariance <- covariance + u^2 v v',   and a row for the scale itself: u^2, coupled by u^2 v.
// A distance in the rig then holds the certificate's relative uncertainty.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "solvers/state.h"

namespace crumple {

struct ScaleUncertainty {
  double relative = 0;  // standard uncertainty
  std::string missing;  // what it does not contain, in words; empty where it is complete
};

// Of the boards that were used: the largest where there are several, as if they erred together. None where a board has
// no certificate: then the scale is not known, whatever the others say.
std::optional<ScaleUncertainty> scale_uncertainty(const std::vector<BoardSpec>& boards,
                                                  const std::vector<std::size_t>& board_of,
                                                  const std::optional<Temperature>& capture);

// Adds the row "scale".
RigCovariance with_scale_uncertainty(const RigCovariance& covariance, const CalibrationState& state, double relative);

}  // namespace crumple
