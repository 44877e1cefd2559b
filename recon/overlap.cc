#include "recon/overlap.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "recon/neighbours.h"

namespace crumple {
namespace {

constexpr std::size_t kSampledSpacings = 500;
constexpr double kPatchReach = 0.75;  // in spacings: half a cell's diagonal and a little

// Of `here`, those that lie in the box of `there`, widened; most pairs of stations have none.
std::vector<std::size_t> within_box(const std::vector<SurfacePatch>& here, const std::vector<SurfacePatch>& there,
                                    const Pose& there_from_here, double margin_mm) {
  Eigen::AlignedBox3d box;
  for (const SurfacePatch& patch : there) box.extend(patch.position_mm);
  std::vector<std::size_t> within;
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (box.squaredExteriorDistance(there_from_here * here[i].position_mm) <= margin_mm * margin_mm)
      within.push_back(i);
  }
  return within;
}

NeighbourTree tree_of(const std::vector<SurfacePatch>& patches) {
  std::vector<CloudPoint> points(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) points[i].position_mm = patches[i].position_mm;
  return NeighbourTree(points);
}

// How far patches lie from the nearest other one, the median of some.
double patch_spacing_mm(const NeighbourTree& tree, std::size_t count) {
  std::vector<float> squares;
  Neighbours found;
  for (std::size_t i = 0; i < count; i += count / kSampledSpacings + 1) {
    tree.nearest(i, 2, found);
    if (found.indices.size() == 2) squares.push_back(found.squared_distance_mm2[1]);
  }
  if (squares.empty()) return 0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

}  // namespace

std::vector<PatchPair> overlap(const std::vector<SurfacePatch>& here, const std::vector<SurfacePatch>& there,
                               const Pose& there_from_here, const OverlapOptions& options) {
  if (here.size() < 2 || there.size() < 2) return {};
  const std::vector<std::size_t> candidates = within_box(here, there, there_from_here, options.across_mm);
  if (candidates.empty()) return {};
  const NeighbourTree of_here = tree_of(here), of_there = tree_of(there);
  const double reach = kPatchReach * patch_spacing_mm(of_there, there.size());
  const double reach_back = kPatchReach * patch_spacing_mm(of_here, here.size());
  const Pose here_from_there = there_from_here.inverse();
  std::vector<PatchPair> pairs;
  Neighbours found;
  // Whether two patches, in one frame, are near along the surface and face each other.
  const auto agree = [&](const Eigen::Vector3d& apart, const Eigen::Vector3d& normal, const Eigen::Vector3d& other,
                         double along_mm) {
    const double across = normal.dot(apart);
    return std::abs(across) <= options.across_mm && (apart - across * normal).norm() <= along_mm &&
           normal.dot(other) >= std::cos(options.largest_normal_angle);
  };
  for (const std::size_t i : candidates) {
    const Eigen::Vector3d place = there_from_here * here[i].position_mm;
    of_there.nearest(place, found);
    if (found.indices.empty()) continue;
    const auto k = static_cast<std::size_t>(found.indices.front());
    const SurfacePatch& met = there[k];
    if (!agree(place - met.position_mm, met.normal, there_from_here.rotation * here[i].normal, reach)) continue;
    const Eigen::Vector3d back = here_from_there * met.position_mm;
    of_here.nearest(back, found);
    const SurfacePatch& nearest = here[static_cast<std::size_t>(found.indices.front())];
    if (!agree(back - nearest.position_mm, nearest.normal, here_from_there.rotation * met.normal, reach_back)) continue;
    pairs.push_back({i, k});
  }
  if (pairs.size() <= options.most) return pairs;
  std::vector<PatchPair> thinned;
  for (std::size_t i = 0; i < options.most; ++i) thinned.push_back(pairs[i * pairs.size() / options.most]);
  return thinned;
}

}  // namespace crumple
