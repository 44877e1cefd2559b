// Takes the points of one view that are not to be trusted out of its cloud: noise, grazing and edge points.
//
// Every rule looks at a point's nearest neighbours (PCL's k-d tree) and is relative to them. PCL's
// StatisticalOutlierRemoval is not used: it compares each mean neighbour distance with the mean and standard deviation
// of the whole cloud. The spacing of a view grows with depth and inclination, so that one threshold takes far and
// oblique surface for noise and lets near noise pass; and the standard deviation is made by the outliers themselves
// (two points 600 mm off among 500 000 double it).
//
//   isolated     farther from its neighbours than these from theirs, by `largest_spacing_ratio` (after Breunig et al.,
//                LOF, SIGMOD 2000: a density relative to the neighbours' own)
//   off_surface  off the plane through its neighbours by more than its own sigma and their scatter explain
//   grazing      the surface is seen at more than `largest_incidence_rad` from its normal
//   edge         the neighbours leave a gap of `largest_gap_rad` around the point: the surface ends or jumps in depth
//                there, and the pixel may have mixed what lies on either side
//
// A point that breaks several rules is counted under the first in this order. Nothing is moved. Same result at any
// number of threads.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "recon/cloud.h"

namespace crumple {

struct CleanOptions {
  int neighbours = 12;  // at least 4
  double largest_spacing_ratio = 2;
  double gate = 25;                      // squared distance from the plane over its variance
  double largest_incidence_rad = 1.309;  // 75 degrees
  double largest_gap_rad = 2.5;          // a straight edge leaves pi, one missing neighbour half of it
  int threads = 1;
};

struct RemovedPoints {
  std::size_t isolated = 0;
  std::size_t off_surface = 0;
  std::size_t grazing = 0;
  std::size_t edge = 0;

  std::size_t total() const { return isolated + off_surface + grazing + edge; }
};

struct CleanedCloud {
  Cloud cloud;  // in the order it was; a normal that was zero is that of the neighbours' plane, towards the viewer
  RemovedPoints removed;
  double spacing_mm = 0;  // side of the square that a point has to itself on the surface, median; 0 without points
};

// `viewer_mm`: where the camera of this view stands, in the cloud's frame. A cloud of no more points than `neighbours`
// is all isolated.
CleanedCloud cleaned(const Cloud& cloud, const Eigen::Vector3d& viewer_mm, const CleanOptions& options = {});

}  // namespace crumple
