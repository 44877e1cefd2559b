// What a capture tells all the same that does not determine its rig: how well each sensor projects what it saw.
//
// Boards that are all parallel leave a focal length and their distances to be exchanged, but not where the lens images
// a point in their plane. So the calibration is done again with the whole rig held by a weak prior
// (calib/lens_prior.h), from a focal length of 1.2 image widths where boards tell none. Terms that this prior decides
// are open. What stays determined is what does not feel them: the projection of points fixed to what was observed
// (solvers/projection_uncertainty.h), whose uncertainty is small where they compensate each other, and grows with the
// prior where they do not. That rig is no calibration; it is not returned.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

// Of a sensor: standard uncertainty in the worst direction, median over its image.
struct DeterminedProjection {
  std::string sensor;
  double there_px = 0;  // in the plane at the median depth of what it saw; how far that is may be open too
  double far_px = 0;    // of what is infinitely far
};

struct DeterminedPart {
  std::vector<std::string> open;  // "cam0.fx", ...; what each may be is not known
  std::vector<DeterminedProjection> projections;
};

// None where the rig is determined, or is not to be had for another reason.
std::optional<DeterminedPart> determined_part(CalibrationData data, CalibrationOptions options);

}  // namespace crumple
