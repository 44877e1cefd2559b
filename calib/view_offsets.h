// By how much a view of a merged cloud may differ from those merged before it, where they overlap, as rig and poses are
// known: what its height over them (recon/merge.h) is to be held against.
//
// At a merged point X of several views, the share of one and that of the earlier ones move apart along the normal by
// n' (S_own - S_earlier) times the variables of rig and poses, S the sensitivities at X (calib/point_uncertainty.h). Of
// the mean over points the variance is that of the mean row: errors that move a view as a whole stay, those that bend
// it average out, and those that both sides share cancel: between two cameras of one station its pose.
#pragma once

#include <cstddef>
#include <vector>

#include "calib/point_uncertainty.h"
#include "recon/cloud.h"

namespace crumple {

struct ViewOffset {
  std::size_t points = 0;  // that were looked at
  double sigma_mm = 0;     // of the mean height over the earlier views; 0 where no point is shared with them
};

// One per view of the uncertainty's poses, which were merged in that order. Of the points that a view shares with
// earlier ones some hundreds are looked at, evenly chosen. Precondition: the cloud's views are those of the poses.
std::vector<ViewOffset> view_offsets(const Cloud& cloud, const PointUncertainty& uncertainty);

}  // namespace crumple
