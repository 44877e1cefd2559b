#include "calib/projection_difference.h"

#include <cmath>

#include <fmt/format.h>

#include "solvers/rig_covariance.h"
#include "solvers/small_motion.h"

namespace crumple {
namespace {

constexpr int kAlignments = 20;
constexpr double kAligned_px = 1e-7;
constexpr double kLeastShare = 0.25;  // of the grid that both must see

// What A sees at the grid's pixels.
struct SeenGrid {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;  // in A's frame, or directions
  std::vector<Matrix2Xd> d_lens;        // of the pixels by A's lens
};

SeenGrid seen_by(const Lens& lens, const ProjectionGrid& grid) {
  SeenGrid seen;
  for (int i = 0; i < grid.columns * grid.rows; ++i) {
    const Eigen::Vector2d pixel((i % grid.columns + 0.5) / grid.columns * lens.size().width_px - 0.5,
                                (i / grid.columns + 0.5) / grid.rows * lens.size().height_px - 0.5);
    const auto ray = lens.ray(pixel);
    if (!ray) continue;
    const Eigen::Vector3d point = std::isinf(grid.distance_mm) ? *ray : grid.distance_mm * ray->normalized();
    seen.pixels.push_back(pixel);
    seen.points.push_back(point);
    seen.d_lens.push_back(lens.project_with_gradients(point)->d_parameters);
  }
  return seen;
}

// Without the points that B does not see.
void keep_seen_by(const Lens& lens, SeenGrid& grid) {
  SeenGrid kept;
  for (std::size_t i = 0; i < grid.points.size(); ++i) {
    if (!lens.project(grid.points[i])) continue;
    kept.pixels.push_back(grid.pixels[i]);
    kept.points.push_back(grid.points[i]);
    kept.d_lens.push_back(grid.d_lens[i]);
  }
  grid = std::move(kept);
}

// B minus A at the present motion; none where B loses a point.
std::optional<Differences> differences_at(const SeenGrid& grid, const Pose& b_from_a, bool infinite, const Lens& lens_b,
                                          const Eigen::MatrixXd& root_a, const Eigen::MatrixXd& root_b,
                                          double no_difference_px) {
  const auto rows = 2 * static_cast<Eigen::Index>(grid.points.size());
  Differences d{.dimension = 2,
                .values = Eigen::VectorXd(rows),
                .by_frame = Eigen::MatrixXd(rows, infinite ? 3 : 6),
                .root = Eigen::MatrixXd(rows, root_a.cols() + root_b.cols()),
                .floor = no_difference_px};
  for (std::size_t i = 0; i < grid.points.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const Eigen::Vector3d point = b_from_a * grid.points[i];
    const auto seen = lens_b.project_with_gradients(point);
    if (!seen) return std::nullopt;
    d.values.segment<2>(row) = seen->pixel - grid.pixels[i];
    const Eigen::MatrixXd by_motion = seen->d_point * d_points_d_motion({point});
    d.by_frame.middleRows<2>(row) = by_motion.leftCols(d.by_frame.cols());
    d.root.block(row, 0, 2, root_a.cols()) = -grid.d_lens[i] * root_a;
    d.root.block(row, root_a.cols(), 2, root_b.cols()) = seen->d_parameters * root_b;
  }
  return d;
}

}  // namespace

std::vector<std::string> lens_row_names(const Rig& rig, std::size_t sensor) {
  const Sensor& owner = rig.sensors[rig.sensors[sensor].lens_of.value_or(sensor)];
  std::vector<std::string> names = lens_parameter_names(owner.lens.model());
  for (std::string& name : names) name = owner.name + "." + name;
  return names;
}

Expected<ProjectionDifference> projection_difference(const Rig& a, std::size_t sensor_a, const Rig& b,
                                                     std::size_t sensor_b, const ProjectionGrid& grid) {
  const Lens &lens_a = a.sensors[sensor_a].lens, &lens_b = b.sensors[sensor_b].lens;
  const std::string& name = a.sensors[sensor_a].name;
  if (lens_a.size() != lens_b.size()) {
    return fail(fmt::format(
        "{} has {} x {} px in one rig and {} x {} px in "
        "the other: these are not one sensor",
        name, lens_a.size().width_px, lens_a.size().height_px, lens_b.size().width_px, lens_b.size().height_px));
  }
  const bool infinite = std::isinf(grid.distance_mm);
  const Eigen::MatrixXd root_a = covariance_root(covariance_of(a.covariance, lens_row_names(a, sensor_a)));
  const Eigen::MatrixXd root_b = covariance_root(covariance_of(b.covariance, lens_row_names(b, sensor_b)));
  SeenGrid seen = seen_by(lens_a, grid);
  keep_seen_by(lens_b, seen);
  if (static_cast<double>(seen.points.size()) < kLeastShare * grid.columns * grid.rows) {
    return fail(fmt::format("the lenses of {} have hardly any part of the image in common", name));
  }
  ProjectionDifference result{seen.pixels, {}, {}};
  for (int turn = 0; turn < kAlignments; ++turn) {
    const auto differences =
        differences_at(seen, result.b_from_a, infinite, lens_b, root_a, root_b, grid.no_difference_px);
    if (!differences) return fail(fmt::format("the two calibrations of {} see in different directions", name));
    result.px = aligned_difference(*differences);
    const double moved_px = (differences->by_frame * result.px.motion).cwiseAbs().maxCoeff();
    if (moved_px < kAligned_px) break;
    Vector6d back = Vector6d::Zero();
    back.head(result.px.motion.size()) = -result.px.motion;
    result.b_from_a = retract({}, back) * result.b_from_a;
  }
  return result;
}

}  // namespace crumple
