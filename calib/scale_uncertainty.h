// How sure the scale of a calibration is: the boards' certificates as priors of the refinement (GUM type B).
//
// Images tell a calibration up to its scale, which is the boards' alone: stretch boards, mounts and placements together
// and no residual changes. So the scale of every board takes part in the refinement as a parameter, under its
// certificate's prior, and every length of the rig holds the certificate's relative uncertainty: of one board, exactly
// covariance + u^2 v v', v the rig's derivative by the scale. Of several, lengths that cameras see on all of them weigh
// the certificates against each other. An error of the capture's temperature is common to all boards.
//
// A scale bar (calib/scale_bar.h) tells lengths as a certified board does, by the distance of its LEDs.
//
// A board without a certificate beside others that have one, or beside a bar, is a parameter too, under a weak prior of
// 5 %: images of a rig whose lengths the others tell determine it. Without either the scale is held at the nominal one
// and not known.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibration_data.h"
#include "solvers/bundle.h"

namespace crumple {

struct ScaleUncertainty {
  double relative = 0;                  // standard uncertainty
  std::vector<std::string> lacks = {};  // what it does not contain, in words; empty where it is complete
};

inline constexpr const char* kWeakScale = "scale.weak";  // the weak prior's name

// Named "certificates", kWeakScale and after the bars; empty where no board that was used has a certificate and there
// is no bar. `start` has the scales that they are about.
std::vector<Prior> scale_priors(const CalibrationData& data, const CalibrationState& start);

// Of a board without a certificate whose size is a parameter: bars, other boards or an earlier rig tell it.
struct MeasuredScale {
  std::size_t board = 0;
  double scale = 1;        // true over nominal size
  double sigma = 0;        // standard uncertainty
  bool determined = true;  // by observations that tie the board to them; else only the weak prior holds it
};

// Of the boards that were used, in their order. `covariance` holds what was kept of an earlier rig too.
std::vector<MeasuredScale> measured_scales(const CalibrationData& data, const BundleResult& bundle,
                                           const JointCovariance& covariance);

// What the certificates of the boards that were used and of the bars lack, behind `known`; each once.
std::vector<std::string> scale_lacks(const CalibrationData& data, std::vector<std::string> known = {});

// Of the boards that were used, the largest after the refinement; none without any, and where no certificate and no bar
// tells it.
std::optional<ScaleUncertainty> scale_uncertainty(const CalibrationData& data, const CalibrationState& state,
                                                  const JointCovariance& covariance);

// That the lengths of a rig contain, by its covariance. What it lacks is not told there, but by the rig itself.
std::optional<ScaleUncertainty> scale_uncertainty(const RigCovariance& covariance);

}  // namespace crumple
