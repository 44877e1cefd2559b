#include "calib/one_tracker.h"

#include <cmath>

#include <fmt/format.h>

#include "solvers/closed_form/resection.h"
#include "solvers/decompositions.h"
#include "solvers/small_problem.h"

namespace crumple {
namespace {

constexpr std::size_t kFewestStations = 6;
constexpr int kFewestSightings = 4;  // of one LED
constexpr double kWorstSlope = 0.01;

// One LED at one station: where it is seen, as the slopes of its ray.
struct LedSlope {
  std::size_t led;
  const Pose* board_from_probe;
  Eigen::Vector2d slope;
};

std::vector<LedSlope> slopes_of(const Lens& lens, const std::vector<LedsBeforeBoard>& stations) {
  std::map<std::size_t, int> counts;
  for (const LedsBeforeBoard& station : stations) {
    for (const std::size_t led : station.leds) ++counts[led];
  }
  std::vector<LedSlope> slopes;
  for (const LedsBeforeBoard& station : stations) {
    for (std::size_t i = 0; i < station.leds.size(); ++i) {
      const auto ray = lens.ray(station.pixels[i]);
      if (!ray || counts[station.leds[i]] < kFewestSightings || !(ray->z() > 0)) continue;
      slopes.push_back({station.leds[i], &station.board_from_probe, ray->hnormalized()});
    }
  }
  return slopes;
}

// The LEDs as one point at the probe's origin.
Expected<Pose> rough_pose(const Lens& lens, const std::vector<LedsBeforeBoard>& stations) {
  std::vector<Eigen::Vector3d> points;
  Points2d slopes;
  for (const LedsBeforeBoard& station : stations) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int count = 0;
    for (const Eigen::Vector2d& pixel : station.pixels) {
      const auto ray = lens.ray(pixel);
      if (!ray || !(ray->z() > 0)) continue;
      sum += ray->hnormalized();
      ++count;
    }
    if (count == 0) continue;
    points.push_back(station.board_from_probe.translation);
    slopes.push_back(sum / count);
  }
  const auto resection = resect(points, slopes);
  if (!resection) return tl::unexpected(resection.error());
  return resection->sensor_from_points;
}

// With the tracker posed, each LED's place by linear least squares of slope times depth.
std::map<std::size_t, Eigen::Vector3d> linear_leds(const std::vector<LedSlope>& slopes,
                                                   const Pose& tracker_from_board) {
  std::map<std::size_t, std::pair<Eigen::Matrix3d, Eigen::Vector3d>> equations;
  for (const LedSlope& seen : slopes) {
    const Pose tracker_from_probe = tracker_from_board * *seen.board_from_probe;
    const Eigen::Matrix3d rotation = tracker_from_probe.rotation.toRotationMatrix();
    Eigen::Matrix<double, 2, 3> across;  // rows: x - u z, y - v z
    across << 1, 0, -seen.slope.x(), 0, 1, -seen.slope.y();
    auto [at, is_new] = equations.try_emplace(seen.led, Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero());
    const Eigen::Matrix<double, 2, 3> rows = across * rotation;
    at->second.first += rows.transpose() * rows;
    at->second.second -= rows.transpose() * (across * tracker_from_probe.translation);
  }
  std::map<std::size_t, Eigen::Vector3d> leds;
  for (const auto& [led, sums] : equations) leds[led] = least_squares(sums.first, sums.second);
  return leds;
}

// Unknowns: the step of tracker_from_board from its start, then the LEDs in their order.
bool slope_residuals(const std::vector<LedSlope>& slopes, const Pose& start,
                     const std::map<std::size_t, Eigen::Index>& columns, const Eigen::VectorXd& x,
                     Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) {
  const Pose tracker_from_board = retract(start, x.head<6>());
  residuals.resize(2 * static_cast<Eigen::Index>(slopes.size()));
  if (jacobian != nullptr) jacobian->setZero(residuals.size(), x.size());
  const Eigen::Matrix3d turn = left_jacobian(x.head<3>());
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    const LedSlope& seen = slopes[i];
    const Eigen::Index column = columns.at(seen.led), row = 2 * static_cast<Eigen::Index>(i);
    const Eigen::Vector3d in_board = *seen.board_from_probe * Eigen::Vector3d(x.segment<3>(column));
    const Eigen::Vector3d point = tracker_from_board * in_board;
    if (!(point.z() > 1)) return false;
    residuals.segment<2>(row) = point.hnormalized() - seen.slope;
    if (jacobian == nullptr) continue;
    Eigen::Matrix<double, 2, 3> d_point;
    d_point << 1 / point.z(), 0, -point.x() / (point.z() * point.z()), 0, 1 / point.z(),
        -point.y() / (point.z() * point.z());
    Matrix3x6d d_pose = d_transformed_d_pose(tracker_from_board, in_board);
    d_pose.leftCols<3>() = d_pose.leftCols<3>().eval() * turn;
    jacobian->block<2, 6>(row, 0) = d_point * d_pose;
    jacobian->block<2, 3>(row, column) =
        d_point * (tracker_from_board.rotation * seen.board_from_probe->rotation).toRotationMatrix();
  }
  return true;
}

}  // namespace

Expected<OneTrackerStart> one_tracker_start(const Lens& lens, const std::vector<LedsBeforeBoard>& stations) {
  if (stations.size() < kFewestStations) {
    return fail(
        fmt::format("one tracker alone wants the probe before the same board from six stations or more; there are {}",
                    stations.size()));
  }
  const std::vector<LedSlope> slopes = slopes_of(lens, stations);
  const auto rough = rough_pose(lens, stations);
  if (!rough) return fail("one tracker alone: " + rough.error().message);
  const auto leds = linear_leds(slopes, *rough);
  if (leds.empty()) return fail("one tracker alone: no LED is seen from four stations");

  std::map<std::size_t, Eigen::Index> columns;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6 + 3 * static_cast<Eigen::Index>(leds.size()));
  for (const auto& [led, position_mm] : leds) {
    const Eigen::Index column = 6 + 3 * static_cast<Eigen::Index>(columns.size());
    columns[led] = column;
    x.segment<3>(column) = position_mm;
  }
  SmallProblem problem;
  problem.residuals = 2 * static_cast<int>(slopes.size());
  problem.evaluate = [&](const Eigen::VectorXd& at, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) {
    return slope_residuals(slopes, *rough, columns, at, residuals, jacobian);
  };
  const auto solution = solve(problem, x, {.sigma = {}, .max_iterations = 300});
  if (!solution) return fail("one tracker alone: " + solution.error().message);
  const double slope_rms = std::sqrt(solution->sum_of_squares / problem.residuals);
  if (!(slope_rms < kWorstSlope)) {
    return fail(
        fmt::format("one tracker alone: the LEDs' paths do not fit the probe's poses before the board: RMS {:.3f} of "
                    "slope; check the LEDs' IDs, and that the board stayed in its place",
                    slope_rms));
  }
  OneTrackerStart start{retract(*rough, solution->x.head<6>()), {}};
  for (const auto& [led, column] : columns) start.led_in_probe_mm[led] = solution->x.segment<3>(column);
  return start;
}

}  // namespace crumple
