#include "calib/one_tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "solvers/decompositions.h"
#include "solvers/small_problem.h"
#include "tracking/pose_starts.h"

namespace crumple {
namespace {

constexpr std::size_t kFewestStations = 4;
constexpr int kFewestSightings = 4;  // of one LED
constexpr double kWorstSlope = 0.01;
// Where an LED may be in the probe frame, about each axis; a start is wanted within some step of where it is.
constexpr int kStepsEachWay = 4;
constexpr double kStep_mm = 150;
constexpr std::size_t kTried = 12;  // starts, the best ones

using Leds = std::map<std::size_t, Eigen::Vector3d>;  // in the probe frame, mm

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

// The LED that most stations see.
std::size_t most_seen(const std::vector<LedSlope>& slopes) {
  std::map<std::size_t, int> counts;
  for (const LedSlope& seen : slopes) ++counts[seen.led];
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

// The tracker posed by the path of one LED, were that at `led_in_probe_mm`.
std::optional<Pose> posed_by_path(const Lens& lens, const std::vector<LedsBeforeBoard>& stations, std::size_t led,
                                  const Eigen::Vector3d& led_in_probe_mm) {
  std::vector<LedSighting> path;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    const auto& leds = stations[s].leds;
    const auto at = std::find(leds.begin(), leds.end(), led);
    if (at == leds.end()) continue;
    LedSighting sighting;
    sighting.led = s;
    sighting.lens = &lens;
    sighting.led_mm = stations[s].board_from_probe * led_in_probe_mm;
    sighting.pixel = stations[s].pixels[static_cast<std::size_t>(at - leds.begin())];
    path.push_back(sighting);
  }
  const std::vector<Pose> poses = quick_starts(path);
  return poses.empty() ? std::nullopt : std::optional(poses.front());
}

// With the tracker posed, each LED's place by linear least squares of slope times depth.
Leds linear_leds(const std::vector<LedSlope>& slopes, const Pose& tracker_from_board) {
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
  Leds leds;
  for (const auto& [led, sums] : equations) leds[led] = least_squares(sums.first, sums.second);
  return leds;
}

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

struct Guess {
  Pose tracker_from_board;
  Leds led_in_probe_mm;
};

// Unknowns: the step of tracker_from_board from the guess, then the LEDs in their order.
struct SlopeFit {
  SlopeFit(const std::vector<LedSlope>& slopes, const Guess& guess)
      : start(6 + 3 * static_cast<Eigen::Index>(guess.led_in_probe_mm.size())) {
    start.head<6>().setZero();
    for (const auto& [led, position_mm] : guess.led_in_probe_mm) {
      const Eigen::Index column = 6 + 3 * static_cast<Eigen::Index>(columns.size());
      columns[led] = column;
      start.segment<3>(column) = position_mm;
    }
    problem.residuals = 2 * static_cast<int>(slopes.size());
    problem.evaluate = [this, &slopes, &guess](const Eigen::VectorXd& at, Eigen::VectorXd& residuals,
                                               Eigen::MatrixXd* jacobian) {
      return slope_residuals(slopes, guess.tracker_from_board, columns, at, residuals, jacobian);
    };
  }
  SlopeFit(const SlopeFit&) = delete;
  SlopeFit& operator=(const SlopeFit&) = delete;

  // None where the guess has LEDs behind the tracker.
  std::optional<double> sum_of_squares() const {
    Eigen::VectorXd residuals;
    if (!problem.evaluate(start, residuals, nullptr)) return std::nullopt;
    return residuals.squaredNorm();
  }

  std::map<std::size_t, Eigen::Index> columns;
  Eigen::VectorXd start;
  SmallProblem problem;
};

// One for every place where the LED seen most may be, the best first.
std::vector<Guess> guesses(const Lens& lens, const std::vector<LedsBeforeBoard>& stations,
                           const std::vector<LedSlope>& slopes) {
  const std::size_t anchor = most_seen(slopes);
  std::vector<std::pair<double, Guess>> ranked;
  for (int i = -kStepsEachWay; i <= kStepsEachWay; ++i) {
    for (int j = -kStepsEachWay; j <= kStepsEachWay; ++j) {
      for (int k = -kStepsEachWay; k <= kStepsEachWay; ++k) {
        const auto pose = posed_by_path(lens, stations, anchor, kStep_mm * Eigen::Vector3d(i, j, k));
        if (!pose) continue;
        Guess guess{*pose, linear_leds(slopes, *pose)};
        const auto squares = SlopeFit(slopes, guess).sum_of_squares();
        if (squares) ranked.emplace_back(*squares, std::move(guess));
      }
    }
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  ranked.resize(std::min(ranked.size(), kTried));
  std::vector<Guess> best;
  for (auto& [squares, guess] : ranked) best.push_back(std::move(guess));
  return best;
}

}  // namespace

Expected<OneTrackerStart> one_tracker_start(const Lens& lens, const std::vector<LedsBeforeBoard>& stations) {
  if (stations.size() < kFewestStations) {
    return fail(
        fmt::format("one tracker alone wants the probe before the same board from {} stations or more; there are {}",
                    kFewestStations, stations.size()));
  }
  const std::vector<LedSlope> slopes = slopes_of(lens, stations);
  if (slopes.empty()) return fail("one tracker alone: no LED is seen from four stations");

  std::optional<OneTrackerStart> found;
  double least = 0;
  std::string failure = "no pose of the tracker has the LEDs before it";
  for (const Guess& guess : guesses(lens, stations, slopes)) {
    const SlopeFit fit(slopes, guess);
    const auto solution = solve(fit.problem, fit.start, {.sigma = {}, .max_iterations = 300});
    if (!solution) {
      failure = solution.error().message;
      continue;
    }
    if (found && solution->sum_of_squares >= least) continue;
    least = solution->sum_of_squares;
    found = OneTrackerStart{retract(guess.tracker_from_board, solution->x.head<6>()), {}};
    for (const auto& [led, column] : fit.columns) found->led_in_probe_mm[led] = solution->x.segment<3>(column);
  }
  if (!found) return fail("one tracker alone: " + failure);
  const double slope_rms = std::sqrt(least / (2 * static_cast<double>(slopes.size())));
  if (!(slope_rms < kWorstSlope)) {
    return fail(
        fmt::format("one tracker alone: the LEDs' paths do not fit the probe's poses before the board: RMS {:.3f} of "
                    "slope; check the LEDs' IDs, and that the board stayed in its place",
                    slope_rms));
  }
  return *found;
}

}  // namespace crumple
