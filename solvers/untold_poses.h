// Poses of boards and stations of which so little is accepted that it does not tell where they are: a refinement would
// fail on them.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "solvers/observations.h"
#include "solvers/residuals.h"
#include "solvers/state.h"
#include "solvers/weights.h"

namespace crumple {

// Of poses with fewer than six accepted coordinates (three corners). With `try_again` the pose may be what is wrong:
// boards get a new one, from the corners that one sensor sees of them, and all that was seen there is accepted again;
// stations only the latter. Returns whether there were any. Without, what is left is given up and the pose held.
// Returns whether one was that had not been. `views` as make_views() makes them of the observations.
bool settle_untold_poses(const std::vector<std::unique_ptr<View>>& views, const Observations& observations,
                         bool try_again, std::vector<ViewWeights>& weights, CalibrationState& state,
                         std::set<BlockId>& held);

}  // namespace crumple
