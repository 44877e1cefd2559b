// Which views to take next, and what they are worth: chosen among candidates (calib/view_candidates.h), one after the
// other, each the one that lowers the uncertainty in the measuring volume (calib/volume_uncertainty.h) most, the ones
// before it taken.
//
// Predicted from the refinement's own Jacobians at the calibration's state, with the noise and the inflation that it
// found (calib/view_information.h). Linear: what the views will show is not in it, and the pose that is taken in the
// end will be another. The greedy choice is not the best set of so many views, but no single exchange is far from it
// where views inform alike (Krause & Golovin, Submodular function maximization, 2014).
#pragma once

#include <vector>

#include "calib/view_candidates.h"

namespace crumple {

struct SuggestedView {
  ViewCandidate view;
  double before = 0, after = 0;  // mean uncertainty in the measuring volume, with the earlier suggestions taken
};

struct NextViews {
  bool triangulated = false;  // of points, mm; else of a camera's projection, px
  double now = 0;
  std::vector<SuggestedView> suggestions;  // fewer than asked for where no candidate is left
};

// Fails where no camera sees a board: there is no measuring volume then.
Expected<NextViews> next_views(const CalibrationData& data, const Calibration& calibration,
                               const std::vector<ViewCandidate>& candidates, int count, int threads);
// Among all of view_candidates.
Expected<NextViews> next_views(const CalibrationData& data, const Calibration& calibration, int count, int threads);

}  // namespace crumple
