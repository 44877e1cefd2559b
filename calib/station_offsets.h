// By how much the stations of a merged cloud may differ where they overlap, as rig and poses are known: what a
// station's height over the others is to be held against.
//
// At a merged point X of several stations, the share of one and that of the rest move apart along the normal by
// n' (S_own - S_rest) times the variables of rig and poses, S the sensitivities at X (calib/point_uncertainty.h). Of
// the mean over points the variance is that of the mean row: errors that move a station as a whole stay, those that
// bend it average out, and those that both stations share cancel.
#pragma once

#include <cstddef>
#include <vector>

#include "calib/point_uncertainty.h"
#include "recon/cloud.h"

namespace crumple {

struct StationOffset {
  std::size_t points = 0;  // that were looked at
  double sigma_mm = 0;     // of the mean height over the rest; 0 where no point is shared
};

// One per station of the uncertainty's poses. Of points that several stations made, evenly chosen ones are looked at,
// some hundred for each station. Precondition: the cloud's views are those of the poses.
std::vector<StationOffset> station_offsets(const Cloud& cloud, const PointUncertainty& uncertainty);

}  // namespace crumple
