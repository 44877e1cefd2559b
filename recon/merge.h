// One cloud from the clouds of many stations: where they overlap, points are fused by their uncertainties.
//
// The merged cloud is a set of sites on the surface, about `spacing_mm` apart, in a voxel hash. A point joins the
// nearest site within three quarters of a spacing along the surface and one spacing across it whose normal is less than
// 60 degrees from its own; where there is none it opens a site. The cloud grows with the surface, not with the number
// of stations: only one station's points are in memory beside it.
//
// Fusing: within a station the points of a site are averaged with weights 1 / v, v the variance along the normal from
// decoding, since the noise of pixels is independent. Between stations the weights are 1 / (v + common^2), `common`
// being what rig and pose put on a station's points alike, the pose's share by its covariance, at the site, along the
// normal: no station is believed beyond it, however many points it has. Positions are means of points, not moved onto a
// model: an edge is rounded by half a spacing, no more.
//
// What a merged point's numbers mean
//   sigma_mm, covariance  along the normal, from decoding alone, carried through the weights that were used. It falls
//                         with the number of points; the share of poses and rig, which falls with the number of
//                         stations at best, is not in it: StationOverlap::difference_mm shows how large it is
//   station, view         the first that saw the site; Cloud::shares has the weights of all that were fused in it
//   quality               mean of the points'; 0 where stations contradict each other
//
// Contradictions: as a station's points have been taken, each site's mean is held against what earlier stations made of
// it, d^2 against (v + common^2) of both, or against the scatter of all this station's differences where that is
// larger: then the station is off as a whole, which difference_mm says. Beyond `gate` nothing is averaged: the
// station's mean becomes a site of its own. When all is merged, sites that face each other within four spacings across
// the surface, and that no station saw both, contradict each other: one station's against two or more agreeing ones is
// left out, the rest stay with quality 0. Both are counted.
//
// Depends on the order of the stations, not on the number of threads.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "recon/cloud.h"
#include "solvers/pose.h"

namespace crumple {

struct MergeOptions {
  double spacing_mm = 0;          // of the merged points
  double common_sigma_mm = 0.05;  // what the rig puts on a station as a whole, one standard deviation
  double gate = 25;
  int threads = 1;
};

// Where a station stood in the frame of all, and how well that is known (tangent of solvers/pose.h). Without a
// covariance it counts as known.
struct StationPlace {
  Pose world_from_probe;
  Matrix6d covariance = Matrix6d::Zero();
};

// One addition against the sites that earlier ones had made.
struct StationOverlap {
  std::string station;
  std::size_t view = 0;           // of its points
  std::size_t points = 0;         // of it
  std::size_t shared_points = 0;  // that joined a site of earlier additions
  std::size_t shared_sites = 0;
  double offset_mm = 0;  // median over shared sites of this station's height over the earlier ones', along the normal
  double difference_mm = 0;  // 1.4826 times the median of its absolute value
  std::size_t split = 0;     // shared sites where it contradicted them
};

struct MergeReport {
  double spacing_mm = 0;
  std::size_t points_in = 0;
  std::size_t without_normal = 0;  // left out: nothing says what surface they are of
  std::size_t points_out = 0;
  double overlap_share = 0;        // of the merged points, seen by two stations or more
  std::size_t contradictions = 0;  // merged points that stay although another station contradicts them, quality 0
  std::size_t outvoted = 0;        // left out
  std::vector<StationOverlap> stations;
};

struct MergedCloud {
  Cloud cloud;
  MergeReport report;
};

class CloudMerger {
 public:
  // Precondition: spacing_mm > 0.
  explicit CloudMerger(const MergeOptions& options);
  ~CloudMerger();
  CloudMerger(CloudMerger&&) noexcept;
  CloudMerger& operator=(CloudMerger&&) noexcept;

  // The cloud of one view, a camera's at a station, in the frame of all; its points have the same CloudPoint::view. A
  // station that is added again, camera after camera, is once among the cloud's stations.
  void add(const Cloud& station, const StationPlace& place = {});

  // Ends the merger: nothing may be added any more.
  MergedCloud finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple
