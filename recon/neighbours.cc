#include "recon/neighbours.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace crumple {

struct NeighbourTree::Impl {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points{new pcl::PointCloud<pcl::PointXYZ>};
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
};

NeighbourTree::NeighbourTree(const std::vector<CloudPoint>& points) : impl_(std::make_unique<Impl>()) {
  if (points.empty()) return;
  Eigen::Vector3d& middle = impl_->middle_mm;
  for (const CloudPoint& point : points) middle += point.position_mm / static_cast<double>(points.size());
  impl_->points->reserve(points.size());
  for (const CloudPoint& point : points) {
    const Eigen::Vector3f p = (point.position_mm - middle).cast<float>();
    impl_->points->push_back({p.x(), p.y(), p.z()});
  }
  impl_->tree.setInputCloud(impl_->points);
}

NeighbourTree::~NeighbourTree() = default;
NeighbourTree::NeighbourTree(NeighbourTree&&) noexcept = default;
NeighbourTree& NeighbourTree::operator=(NeighbourTree&&) noexcept = default;

void NeighbourTree::nearest(std::size_t point, int count, Neighbours& found) const {
  impl_->tree.nearestKSearch((*impl_->points)[point], count, found.indices, found.squared_distance_mm2);
}

void NeighbourTree::nearest(const Eigen::Vector3d& place_mm, Neighbours& found) const {
  found.indices.clear();
  if (impl_->points->empty()) return;
  const Eigen::Vector3f p = (place_mm - impl_->middle_mm).cast<float>();
  impl_->tree.nearestKSearch(pcl::PointXYZ(p.x(), p.y(), p.z()), 1, found.indices, found.squared_distance_mm2);
}

void NeighbourTree::within(std::size_t point, double radius_mm, Neighbours& found) const {
  impl_->tree.radiusSearch((*impl_->points)[point], radius_mm, found.indices, found.squared_distance_mm2);
}

}  // namespace crumple
