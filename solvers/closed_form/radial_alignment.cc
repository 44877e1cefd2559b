#include "solvers/closed_form/radial_alignment.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr std::size_t kMinimumPoints = 6;
constexpr double kAmbiguous = 1e-9;    // of the largest eigenvalue: points on a line
constexpr double kNoDistances = 1e-8;  // of the equilibrated system's largest eigenvalue
constexpr int kRounds = 5;

using RadiusTerms = Eigen::Vector3d;  // of g

// A view in normalised coordinates: plane points about their centroid, pixels about the centre.
struct Aligned {
  Points2d plane;
  Points2d image;
  Eigen::Matrix<double, 2, 3> xy;  // of the pose: two rows of [r1 r2 t]
  Eigen::RowVector2d depth;        // r31 r32, up to their common sign
};

RadiusTerms powers(const Eigen::Vector2d& image) {
  const double square = image.squaredNorm();
  return {1, square, square * square};
}

// The rows' scale and the third components of r1 and r2, from both being unit vectors at a right angle.
bool complete(const Eigen::Matrix<double, 2, 3>& rows, Aligned& view) {
  const double first = rows.col(0).squaredNorm(), second = rows.col(1).squaredNorm();
  const double product = rows.col(0).dot(rows.col(1));
  const double difference = second - first;
  const double root = std::hypot(difference, 2 * product);
  const double p_square = 0.5 * (difference + root), q_square = 0.5 * (root - difference);
  const double scale = std::sqrt(first + p_square);
  if (!(scale > 0)) return false;
  view.xy = rows / scale;
  view.depth =
      Eigen::RowVector2d(std::sqrt(p_square), product > 0 ? -std::sqrt(q_square) : std::sqrt(q_square)) / scale;
  // Points lie on the side of the centre where their images do.
  double side = 0;
  for (std::size_t i = 0; i < view.plane.size(); ++i) side += view.image[i].dot(view.xy * view.plane[i].homogeneous());
  if (side < 0) view.xy = -view.xy;
  return true;
}

// u y - v x = 0 for x, y linear in the pose's first two rows.
bool align(Aligned& view) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t i = 0; i < view.plane.size(); ++i) {
    const Eigen::Vector3d p = view.plane[i].homogeneous();
    Eigen::Matrix<double, 6, 1> row;
    row << -view.image[i].y() * p, view.image[i].x() * p;
    normal += row * row.transpose();
  }
  const SymmetricEigen eigen = symmetric_eigen(normal);
  if (!(eigen.values[1] > kAmbiguous * eigen.values[5])) return false;
  const Eigen::VectorXd v = eigen.vectors.col(0);
  Eigen::Matrix<double, 2, 3> rows;
  rows << v.head<3>().transpose(), v.tail<3>().transpose();
  return complete(rows, view);
}

// What every view says of g, and of its own distance: g (x, y) = (z0 + t3) (u, v).
struct Equations {
  Eigen::Matrix3d terms = Eigen::Matrix3d::Zero();
  RadiusTerms right = RadiusTerms::Zero();
  RadiusTerms coupling = RadiusTerms::Zero();
  double distance = 0;
  double distance_right = 0;

  double distance_for(const RadiusTerms& g) const { return (distance_right - coupling.dot(g)) / distance; }
};

Equations equations_of(const Aligned& view) {
  Equations e;
  for (std::size_t i = 0; i < view.plane.size(); ++i) {
    const Eigen::Vector2d xy = view.xy * view.plane[i].homogeneous();
    const double z = view.depth * view.plane[i];
    const RadiusTerms t = powers(view.image[i]);
    e.terms += xy.squaredNorm() * t * t.transpose();
    e.right += xy.dot(view.image[i]) * z * t;
    e.coupling -= xy.dot(view.image[i]) * t;
    e.distance += view.image[i].squaredNorm();
    e.distance_right -= view.image[i].squaredNorm() * z;
  }
  return e;
}

std::optional<RadiusTerms> solve_terms(const std::vector<Aligned>& views) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  RadiusTerms right = RadiusTerms::Zero();
  for (const Aligned& view : views) {
    const Equations e = equations_of(view);
    matrix += e.terms - e.coupling * e.coupling.transpose() / e.distance;
    right += e.right - e.coupling * (e.distance_right / e.distance);
  }
  const Eigen::Vector3d scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * matrix * scale.asDiagonal());
  if (!(eigen.values[0] > kNoDistances * eigen.values[2])) return std::nullopt;
  return RadiusTerms(solve_symmetric(matrix, right));
}

// The view alone, with g constant: a pinhole's focal length, whose sign says which of the two tilts it is.
void choose_tilt(Aligned& view) {
  const Equations e = equations_of(view);
  const double own = e.terms(0, 0) - e.coupling[0] * e.coupling[0] / e.distance;
  const double focal = (e.right[0] - e.coupling[0] * e.distance_right / e.distance) / own;
  if (focal < 0) view.depth = -view.depth;
}

double misfit(const Aligned& view, const RadiusTerms& g) {
  const double distance = equations_of(view).distance_for(g);
  double sum = 0;
  for (std::size_t i = 0; i < view.plane.size(); ++i) {
    const Eigen::Vector2d xy = view.xy * view.plane[i].homogeneous();
    const double z = view.depth * view.plane[i] + distance;
    sum += (g.dot(powers(view.image[i])) * xy - z * view.image[i]).squaredNorm();
  }
  return sum;
}

// True where the other tilt agrees better with all the views' g.
bool turned(Aligned& view, const RadiusTerms& g) {
  Aligned other = view;
  other.depth = -view.depth;
  if (misfit(other, g) >= misfit(view, g)) return false;
  view = other;
  return true;
}

std::optional<Aligned> aligned(const PlaneView& view, const Eigen::Matrix3d& similarity,
                               const Eigen::Vector2d& centre_px, double radius_px) {
  if (view.pixels.size() < kMinimumPoints) return std::nullopt;
  Aligned result;
  for (const Eigen::Vector2d& p : view.plane_mm) result.plane.push_back(apply_homography(similarity, p));
  for (const Eigen::Vector2d& p : view.pixels) result.image.push_back((p - centre_px) / radius_px);
  if (!align(result)) return std::nullopt;
  choose_tilt(result);
  return result;
}

std::optional<RadiusTerms> solve_together(std::vector<Aligned>& views) {
  auto g = solve_terms(views);
  for (int round = 0; g && round < kRounds; ++round) {
    bool changed = false;
    for (Aligned& view : views) changed = turned(view, *g) || changed;
    if (!changed) break;
    g = solve_terms(views);
  }
  return g;
}

// From the pose of the normalised plane.
std::optional<Pose> plane_in_front(const Aligned& view, const RadiusTerms& g, const Eigen::Matrix3d& similarity,
                                   const Points2d& plane_mm) {
  Eigen::Matrix3d columns;
  columns << view.xy, view.depth, equations_of(view).distance_for(g);
  Eigen::Matrix3d rotation;
  rotation << columns.leftCols<2>(), columns.col(0).cross(columns.col(1));
  const Eigen::Vector3d moved = columns.leftCols<2>() * similarity.topRightCorner<2, 1>();
  const Pose pose{Eigen::Quaterniond(rotation).normalized(), (columns.col(2) + moved) / similarity(0, 0)};
  for (const Eigen::Vector2d& p : plane_mm) {
    if (!((pose * Eigen::Vector3d(p.x(), p.y(), 0)).z() > 0)) return std::nullopt;
  }
  return pose;
}

}  // namespace

Expected<std::vector<std::optional<Pose>>> align_radially(const Eigen::Vector2d& centre_px,
                                                          const std::vector<PlaneView>& views) {
  double radius_px = 0;
  for (const PlaneView& view : views) {
    assert(view.plane_mm.size() == view.pixels.size());
    for (const Eigen::Vector2d& pixel : view.pixels) radius_px = std::max(radius_px, (pixel - centre_px).norm());
  }
  std::vector<Aligned> told;
  std::vector<Eigen::Matrix3d> similarities;
  std::vector<std::size_t> indices;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Matrix3d similarity = normalising_similarity(views[v].plane_mm);
    auto view = aligned(views[v], similarity, centre_px, radius_px);
    if (!view) continue;
    told.push_back(std::move(*view));
    similarities.push_back(similarity);
    indices.push_back(v);
  }
  const auto g = solve_together(told);
  if (!g) return fail("the views do not tell their distances: tilt the board");
  std::vector<std::optional<Pose>> poses(views.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    poses[indices[i]] = plane_in_front(told[i], *g, similarities[i], views[indices[i]].plane_mm);
  }
  return poses;
}

}  // namespace crumple
