#include "solvers/closed_form/board_pose.h"

#include <Eigen/Geometry>

#include "solvers/closed_form/zhang.h"

namespace crumple {

std::optional<Pose> board_pose(const Lens& lens, const Points2d& plane_mm, const Points2d& pixels) {
  Points2d plane, slopes;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto ray = lens.ray(pixels[i]);
    if (!ray || ray->z() <= 0) continue;
    plane.push_back(plane_mm[i]);
    slopes.emplace_back(ray->hnormalized());
  }
  const auto slopes_from_plane = homography(plane, slopes);
  if (!slopes_from_plane) return std::nullopt;
  return plane_pose(*slopes_from_plane, Eigen::Matrix3d::Identity());
}

}  // namespace crumple
