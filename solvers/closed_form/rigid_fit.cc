#include "solvers/closed_form/rigid_fit.h"

#include <cassert>

#include <Eigen/Geometry>

#include "solvers/closed_form/plane.h"

namespace crumple {

Expected<Pose> rigid_fit(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  assert(a.size() == b.size());
  if (a.size() < 3) return fail("a rigid motion needs at least three points");
  if (!fit_plane(a) || !fit_plane(b)) return fail("the points lie on a line, so the turn about it cannot be told");
  const Eigen::Map<const Eigen::Matrix3Xd> from(a.front().data(), 3, static_cast<Eigen::Index>(a.size()));
  const Eigen::Map<const Eigen::Matrix3Xd> to(b.front().data(), 3, static_cast<Eigen::Index>(b.size()));
  const Eigen::Matrix4d m = Eigen::umeyama(from, to, false);
  return Pose{Eigen::Quaterniond(m.topLeftCorner<3, 3>()), m.topRightCorner<3, 1>()};
}

}  // namespace crumple
