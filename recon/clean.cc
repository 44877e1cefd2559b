#include "recon/clean.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>

#include "recon/neighbours.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t clean_block = 4096;
// As low as a sigma is believed when points are held against planes: clouds made by hand have none.
constexpr double least_clean_sigma_mm = 1e-6;

enum class Verdict : std::uint8_t { kept, isolated, off_surface, grazing, edge };

struct LocalPlane {
  Eigen::Vector3d middle_mm;
  Eigen::Vector3d normal;
  double scatter_mm2;  // variance of the neighbours about it
};

class Cleaner {
 public:
  Cleaner(const std::vector<CloudPoint>& points, const Eigen::Vector3d& viewer_mm, const CleanOptions& options)
      : points_(points),
        viewer_(viewer_mm),
        options_(options),
        count_(static_cast<std::size_t>(options.neighbours)),
        neighbours_(points.size() * count_),
        reach_(points.size()),
        verdicts_(points.size()),
        normals_(points.size()) {}

  CleanedCloud run() {
    find_neighbours();
    in_blocks([&](std::size_t i) { verdicts_[i] = judge(i); });
    CleanedCloud result;
    std::vector<float> spacings;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      count(verdicts_[i], result.removed);
      if (verdicts_[i] != Verdict::kept) continue;
      result.cloud.points.push_back(points_[i]);
      // At a rim a grid's own normal may stand across the surface that the neighbours lie on.
      if (points_[i].normal.isZero(0) || grazes(points_[i].normal.cast<double>(), i)) {
        result.cloud.points.back().normal = normals_[i];
      }
      spacings.push_back(reach_[i]);
    }
    if (spacings.empty()) return result;
    const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
    std::nth_element(spacings.begin(), middle, spacings.end());
    // The disc that reaches to the last neighbour holds them all and the point.
    result.spacing_mm = *middle * std::sqrt(std::numbers::pi / static_cast<double>(count_ + 1));
    return result;
  }

 private:
  template <typename Work>
  void in_blocks(const Work& work) const {
    parallel_for((points_.size() + clean_block - 1) / clean_block, options_.threads, [&](std::size_t block) {
      const std::size_t end = std::min(points_.size(), (block + 1) * clean_block);
      for (std::size_t i = block * clean_block; i < end; ++i) work(i);
    });
  }

  void find_neighbours() {
    const NeighbourTree tree(points_);
    parallel_for((points_.size() + clean_block - 1) / clean_block, options_.threads, [&](std::size_t block) {
      Neighbours found;
      const std::size_t end = std::min(points_.size(), (block + 1) * clean_block);
      for (std::size_t i = block * clean_block; i < end; ++i) {
        tree.nearest(i, options_.neighbours + 1, found);
        // The point itself comes first, but for another at the very same place.
        const auto self = std::find(found.indices.begin(), found.indices.end() - 1, static_cast<int>(i));
        found.indices.erase(self);
        std::copy(found.indices.begin(), found.indices.end(), neighbours_.begin() + i * count_);
        reach_[i] = std::sqrt(found.squared_distance_mm2.back());
      }
    });
  }

  const Eigen::Vector3d& neighbour(std::size_t i, std::size_t k) const {
    return points_[neighbours_[i * count_ + k]].position_mm;
  }

  LocalPlane plane(std::size_t i) const {
    LocalPlane plane{Eigen::Vector3d::Zero(), {}, 0};
    for (std::size_t k = 0; k < count_; ++k) plane.middle_mm += neighbour(i, k) / static_cast<double>(count_);
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < count_; ++k) {
      const Eigen::Vector3d d = neighbour(i, k) - plane.middle_mm;
      moments += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(moments);
    plane.normal = solver.eigenvectors().col(0);
    plane.scatter_mm2 = std::max(0.0, solver.eigenvalues()[0]) / static_cast<double>(count_ - 3);
    return plane;
  }

  Verdict judge(std::size_t i) {
    if (is_isolated(i)) return Verdict::isolated;
    const CloudPoint& point = points_[i];
    const LocalPlane local = plane(i);
    const Eigen::Vector3d ray = (point.position_mm - viewer_).normalized();
    const Eigen::Vector3d normal = local.normal.dot(ray) > 0 ? Eigen::Vector3d(-local.normal) : local.normal;
    normals_[i] = normal.cast<float>();
    const double off = normal.dot(point.position_mm - local.middle_mm);
    const double own =
        std::max(normal.dot(point.covariance_mm2.cast<double>() * normal), least_clean_sigma_mm * least_clean_sigma_mm);
    if (off * off > options_.gate * (own + local.scatter_mm2)) return Verdict::off_surface;
    if (grazes(normal, i)) return Verdict::grazing;
    return gap(i, normal) > options_.largest_gap_rad ? Verdict::edge : Verdict::kept;
  }

  bool grazes(const Eigen::Vector3d& normal, std::size_t i) const {
    const Eigen::Vector3d ray = (points_[i].position_mm - viewer_).normalized();
    return std::abs(normal.dot(ray)) < std::cos(options_.largest_incidence_rad);
  }

  bool is_isolated(std::size_t i) const {
    std::vector<float> reaches(count_);
    for (std::size_t k = 0; k < count_; ++k) reaches[k] = reach_[neighbours_[i * count_ + k]];
    const auto middle = reaches.begin() + static_cast<std::ptrdiff_t>(count_ / 2);
    std::nth_element(reaches.begin(), middle, reaches.end());
    return reach_[i] > options_.largest_spacing_ratio * *middle;
  }

  // The largest angle between directions to consecutive neighbours, seen along the normal.
  double gap(std::size_t i, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d u = normal.unitOrthogonal();
    const Eigen::Vector3d v = normal.cross(u);
    std::vector<double> angles(count_);
    for (std::size_t k = 0; k < count_; ++k) {
      const Eigen::Vector3d d = neighbour(i, k) - points_[i].position_mm;
      angles[k] = std::atan2(d.dot(v), d.dot(u));
    }
    std::sort(angles.begin(), angles.end());
    double largest = angles.front() + 2 * std::numbers::pi - angles.back();
    for (std::size_t k = 1; k < count_; ++k) largest = std::max(largest, angles[k] - angles[k - 1]);
    return largest;
  }

  static void count(Verdict verdict, RemovedPoints& removed) {
    removed.isolated += verdict == Verdict::isolated;
    removed.off_surface += verdict == Verdict::off_surface;
    removed.grazing += verdict == Verdict::grazing;
    removed.edge += verdict == Verdict::edge;
  }

  const std::vector<CloudPoint>& points_;
  const Eigen::Vector3d viewer_;
  const CleanOptions& options_;
  const std::size_t count_;
  std::vector<int> neighbours_;  // count_ per point
  std::vector<float> reach_;     // distance to the last of them
  std::vector<Verdict> verdicts_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace

CleanedCloud cleaned(const Cloud& cloud, const Eigen::Vector3d& viewer_mm, const CleanOptions& options) {
  CleanedCloud result;
  if (cloud.points.size() <= static_cast<std::size_t>(options.neighbours)) {
    result.removed.isolated = cloud.points.size();
  } else {
    result = Cleaner(cloud.points, viewer_mm, options).run();
  }
  result.cloud.frame = cloud.frame;
  result.cloud.stations = cloud.stations;
  return result;
}

}  // namespace crumple
