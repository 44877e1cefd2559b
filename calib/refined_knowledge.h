// What is known of the rig and of the stations' poses after stations were refined together (calib/refine_stations.h),
// in the form that points' uncertainty is computed from.
//
// The refinement gives P, the joint covariance of the rig's parameters t that it touched and of the poses p. Of the
// others, which only their correlation with t ties to it, the rig's covariance C becomes
//   C + K (P_tt - C_tt) K',   K = C_.t C_tt^-1        (a new covariance of t, all else as it was given t)
// and the poses split into what the rig moves and the rest, which stations that share surface have in common:
//   G = P_pt P_tt^-1,   noise P_pp - G P_tp.
#pragma once

#include "calib/refine_stations.h"
#include "calib/station_poses.h"

namespace crumple {

struct RefinedKnowledge {
  RigCovariance covariance;  // rows as the rig's
  StationPoses poses;        // no views
};

// `rig` is the one that the refinement was given. Fails where its covariance, or that of the refinement, is not
// positive definite.
Expected<RefinedKnowledge> refined_knowledge(const Rig& rig, const std::vector<ObservedStation>& stations,
                                             const StationRefinement& refined);

}  // namespace crumple
