// Which points of a cloud are near which: PCL's k-d tree (pcl::KdTreeFLANN), its headers kept out of ours.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "recon/cloud.h"

namespace crumple {

// Points that are near one, nearest first; the point itself is among them.
struct Neighbours {
  std::vector<int> indices;                 // into the cloud's points
  std::vector<float> squared_distance_mm2;  // of each
};

// A copy of the positions, in single precision about their middle: distances are good to 1e-7 of the cloud's size.
// Searches are const and may run in several threads. Precondition: every position is finite.
class NeighbourTree {
 public:
  explicit NeighbourTree(const std::vector<CloudPoint>& points);
  ~NeighbourTree();
  NeighbourTree(NeighbourTree&&) noexcept;
  NeighbourTree& operator=(NeighbourTree&&) noexcept;

  // Both fill `found` anew, which saves an allocation per search. Fewer than `count` where the cloud has fewer.
  void nearest(std::size_t point, int count, Neighbours& found) const;
  void within(std::size_t point, double radius_mm, Neighbours& found) const;
  // The one nearest to a place; none where there are no points.
  void nearest(const Eigen::Vector3d& place_mm, Neighbours& found) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple
