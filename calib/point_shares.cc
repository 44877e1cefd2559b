#include "calib/point_shares.h"

namespace crumple {

PointShares::PointShares(const Cloud& cloud) : cloud_(cloud) {
  if (cloud.shares.empty()) return;
  first_.assign(cloud.points.size() + 1, 0);
  for (const CloudShare& share : cloud.shares) ++first_[share.point + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
}

std::span<const CloudShare> PointShares::of(std::size_t point, CloudShare& own) const {
  if (!first_.empty() && first_[point + 1] > first_[point]) {
    return std::span(cloud_.shares).subspan(first_[point], first_[point + 1] - first_[point]);
  }
  own = {static_cast<std::uint32_t>(point), cloud_.points[point].view, 1};
  return {&own, 1};
}

}  // namespace crumple
