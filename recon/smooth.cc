#include "recon/smooth.h"

#include <algorithm>
#include <numeric>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/mls.h>
// The fit is compiled here: the library that has it, pcl_surface, loads VTK and Qt with it.
#include <pcl/surface/impl/mls.hpp>

#include "recon/neighbours.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t smooth_block = 1024;

// The neighbours' positions from the point itself, which keeps single precision far below the noise.
pcl::PointCloud<pcl::PointXYZ> around(const std::vector<CloudPoint>& points, std::size_t i,
                                      const std::vector<int>& neighbours) {
  pcl::PointCloud<pcl::PointXYZ> patch;
  patch.push_back({0, 0, 0});
  for (const int k : neighbours) {
    if (static_cast<std::size_t>(k) == i) continue;
    const Eigen::Vector3f p = (points[k].position_mm - points[i].position_mm).cast<float>();
    patch.push_back({p.x(), p.y(), p.z()});
  }
  return patch;
}

// False where the neighbours do not determine the polynomial.
bool smooth_point(const std::vector<CloudPoint>& points, std::size_t i, const std::vector<int>& neighbours,
                  const Eigen::Vector3d& viewer_mm, const SmoothOptions& options, CloudPoint& result) {
  const int terms = (options.order + 1) * (options.order + 2) / 2;
  if (static_cast<int>(neighbours.size()) <= terms) return false;
  const auto patch = around(points, i, neighbours);
  pcl::Indices all(patch.size());
  std::iota(all.begin(), all.end(), 0);
  pcl::MLSResult fit;
  fit.computeMLSSurface(patch, 0, all, options.radius_mm, options.order);
  if (!fit.valid) return false;
  const auto place = fit.projectQueryPoint(pcl::MLSResult::SIMPLE, terms);
  // Neighbours on a line leave the polynomial undetermined.
  if (!place.point.allFinite() || !place.normal.allFinite() || place.point.norm() > options.radius_mm) return false;
  result.position_mm += place.point;
  const Eigen::Vector3d normal = place.normal.normalized();
  result.normal = (normal.dot(viewer_mm - result.position_mm) < 0 ? Eigen::Vector3d(-normal) : normal).cast<float>();
  return true;
}

}  // namespace

SmoothedCloud smoothed(const Cloud& cloud, const std::vector<Eigen::Vector3d>& viewers_mm,
                       const SmoothOptions& options) {
  SmoothedCloud result{cloud, 0};
  const std::size_t count = cloud.points.size();
  const NeighbourTree tree(cloud.points);
  std::vector<char> moved(count);
  parallel_for((count + smooth_block - 1) / smooth_block, options.threads, [&](std::size_t block) {
    Neighbours near;
    for (std::size_t i = block * smooth_block; i < std::min(count, (block + 1) * smooth_block); ++i) {
      tree.within(i, options.radius_mm, near);
      CloudPoint& point = result.cloud.points[i];
      moved[i] = smooth_point(cloud.points, i, near.indices, viewers_mm[point.station], options, point);
    }
  });
  result.left_alone = static_cast<std::size_t>(std::count(moved.begin(), moved.end(), 0));
  return result;
}

}  // namespace crumple
