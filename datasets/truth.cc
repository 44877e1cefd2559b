#include "datasets/truth.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>

#include "datasets/rig_file.h"
#include "datasets/scene_file.h"
#include "solvers/decompositions.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr double trim_sigmas = 5;
constexpr double sigma_of_mad = 1.4826;
constexpr std::size_t block_points = 4096;

struct TruePlace {
  const Surface* surface;
  Pose cloud_from_surface;
};

Deviation deviation_of(const CloudPoint& point, const TruePlace& placed) {
  const Eigen::Vector3d in_surface = placed.cloud_from_surface.inverse() * point.position_mm;
  const Eigen::Vector3d nearest = placed.surface->nearest(in_surface);
  const Eigen::Vector3d normal = placed.surface->at(nearest.x(), nearest.y()).normal;
  const Eigen::Vector3d offset = in_surface - nearest;
  Deviation deviation;
  deviation.distance_mm = std::copysign(offset.norm(), offset.dot(normal));
  deviation.normal = placed.cloud_from_surface.rotation * normal;
  const double variance = deviation.normal.dot(point.covariance_mm2.cast<double>() * deviation.normal);
  deviation.predicted_mm = std::sqrt(std::max(0.0, variance));
  return deviation;
}

Expected<std::vector<TruePlace>> placements(const Cloud& cloud, const Scene& scene) {
  std::vector<TruePlace> placed;
  for (const std::string& id : cloud.stations) {
    const auto station = std::find_if(scene.stations.begin(), scene.stations.end(),
                                      [&](const SceneStation& candidate) { return candidate.id == id; });
    if (station == scene.stations.end()) return fail(fmt::format("the truth knows no station {}", id));
    if (!station->in_view) return fail(fmt::format("nothing was in view at station {}", id));
    const Pose cloud_from_surface = cloud.frame == "world" ? world_from_surface(*station) : station->probe_from_surface;
    placed.push_back({&surface_at(scene, *station), cloud_from_surface});
  }
  return placed;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Sums over the points that were kept.
struct Spread {
  double squares = 0, standardised = 0, predicted = 0;
  std::size_t count = 0, with_prediction = 0;

  void add(double distance_mm, double predicted_mm) {
    squares += distance_mm * distance_mm;
    ++count;
    if (predicted_mm <= 0) return;
    standardised += distance_mm * distance_mm / (predicted_mm * predicted_mm);
    predicted += predicted_mm * predicted_mm;
    ++with_prediction;
  }
  static double root_mean(double sum, std::size_t n) { return n == 0 ? 0 : std::sqrt(sum / static_cast<double>(n)); }
  double rms_mm() const { return root_mean(squares, count); }
  double ratio() const { return root_mean(standardised, with_prediction); }
  double predicted_mm() const { return root_mean(predicted, with_prediction); }
};

// How the distances change per unit of a rigid motion about the cloud's centre: rotation, then translation.
Vector6d motion_row(const CloudPoint& point, const Deviation& deviation, const Eigen::Vector3d& centre_mm) {
  Vector6d row;
  row << (point.position_mm - centre_mm).cross(deviation.normal), deviation.normal;
  return row;
}

Eigen::Vector3d centre_of(const Cloud& cloud) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const CloudPoint& point : cloud.points) centre += point.position_mm / static_cast<double>(cloud.points.size());
  return centre;
}

struct Trim {
  double robust_sigma_mm = 0;
  std::vector<char> kept;
};

// Precondition: there are deviations.
Trim trim(const std::vector<Deviation>& deviations) {
  std::vector<double> values;
  for (const Deviation& deviation : deviations) values.push_back(deviation.distance_mm);
  const double median = median_of(values);
  for (double& value : values) value = std::abs(value - median);
  Trim trim{sigma_of_mad * median_of(values), std::vector<char>(deviations.size())};
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    trim.kept[i] = std::abs(deviations[i].distance_mm - median) <= trim_sigmas * trim.robust_sigma_mm;
  }
  return trim;
}

std::vector<Deviation> after_rigid_motion(const Cloud& cloud, std::vector<Deviation> deviations,
                                          const std::vector<char>& kept) {
  const Eigen::Vector3d centre = centre_of(cloud);
  Matrix6d normal_matrix = Matrix6d::Zero();
  Vector6d right_side = Vector6d::Zero();
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    if (!kept[i]) continue;
    const Vector6d row = motion_row(cloud.points[i], deviations[i], centre);
    normal_matrix += row * row.transpose();
    right_side -= row * deviations[i].distance_mm;
  }
  // A flat surface leaves three of the six undetermined; a speck of damping, in the matrix' own scale, holds them.
  normal_matrix.diagonal() *= 1 + 1e-9;
  normal_matrix.diagonal().array() += 1e-9;
  const Vector6d motion = solve_symmetric(normal_matrix, right_side);
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    deviations[i].distance_mm += motion_row(cloud.points[i], deviations[i], centre).dot(motion);
  }
  return deviations;
}

}  // namespace

Expected<Rig> read_true_rig(const std::filesystem::path& folder) { return read_rig(folder / "rig"); }

Expected<Scene> read_true_scene(const std::filesystem::path& folder) { return read_scene(folder / "scene.yaml"); }

Expected<std::vector<Deviation>> deviations_from_truth(const Cloud& cloud, const Scene& scene, int threads) {
  const auto placed = placements(cloud, scene);
  if (!placed) return tl::unexpected(placed.error());
  std::vector<Deviation> deviations(cloud.points.size());
  parallel_for((deviations.size() + block_points - 1) / block_points, threads, [&](std::size_t block) {
    const std::size_t end = std::min(deviations.size(), (block + 1) * block_points);
    for (std::size_t i = block * block_points; i < end; ++i) {
      deviations[i] = deviation_of(cloud.points[i], (*placed)[cloud.points[i].station]);
    }
  });
  return deviations;
}

DeviationSummary summarise(const Cloud& cloud, const std::vector<Deviation>& deviations) {
  assert(cloud.points.size() == deviations.size());
  DeviationSummary summary;
  summary.points = deviations.size();
  if (deviations.empty()) return summary;
  const auto [robust_sigma_mm, kept] = trim(deviations);
  const std::vector<Deviation> moved = after_rigid_motion(cloud, deviations, kept);
  Spread all, trimmed, moved_all, moved_trimmed;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    const Deviation& deviation = deviations[i];
    all.add(deviation.distance_mm, deviation.predicted_mm);
    moved_all.add(moved[i].distance_mm, moved[i].predicted_mm);
    summary.mean_mm += deviation.distance_mm / static_cast<double>(deviations.size());
    summary.max_mm = std::max(summary.max_mm, std::abs(deviation.distance_mm));
    if (!kept[i]) continue;
    trimmed.add(deviation.distance_mm, deviation.predicted_mm);
    moved_trimmed.add(moved[i].distance_mm, moved[i].predicted_mm);
  }
  summary.robust_sigma_mm = robust_sigma_mm;
  summary.rms_mm = all.rms_mm();
  summary.trimmed_rms_mm = trimmed.rms_mm();
  summary.trimmed_share = 1 - static_cast<double>(trimmed.count) / static_cast<double>(deviations.size());
  summary.predicted_mm = trimmed.predicted_mm();
  summary.observed_over_predicted = trimmed.ratio();
  summary.moved_rms_mm = moved_trimmed.rms_mm();
  summary.moved_over_predicted = moved_trimmed.ratio();
  summary.moved_all_rms_mm = moved_all.rms_mm();
  return summary;
}

std::vector<Deviation> moved_deviations(const Cloud& cloud, std::vector<Deviation> deviations) {
  assert(cloud.points.size() == deviations.size());
  if (deviations.empty()) return deviations;
  const std::vector<char> kept = trim(deviations).kept;
  return after_rigid_motion(cloud, std::move(deviations), kept);
}

}  // namespace crumple
