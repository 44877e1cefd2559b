#include "calib/moved_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "solvers/decompositions.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastStations = 3;  // on either side
constexpr double kLeftOver = 0.5;          // of the sum of squares
constexpr double kSignificant = 5;         // standard uncertainties
constexpr double kDegreesPerRad = 180 / std::numbers::pi;

// Normal equations of a mount from the LEDs of some stations.
struct MountEquations {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();

  void add(const MountEquations& other) {
    information += other.information;
    gradient += other.gradient;
  }
  double gain() const { return gradient.dot(Vector6d(solve_symmetric(information, gradient))); }
};

// By sensor and station.
std::vector<std::vector<MountEquations>> mount_equations(const Observations& observations,
                                                         const CalibrationState& state) {
  std::vector<std::vector<MountEquations>> equations(state.rig.sensors.size(),
                                                     std::vector<MountEquations>(state.world_from_probe.size()));
  for (const auto& view : make_views(observations, state.board_of)) {
    if (view->kind() != View::Kind::leds || !view->station()) continue;
    ViewEvaluation evaluation;
    if (!view->evaluate(state, true, evaluation)) continue;
    const auto mount =
        std::find(view->blocks().begin(), view->blocks().end(), BlockId{BlockId::Kind::mount, view->sensor()});
    const Eigen::MatrixXd jacobian =
        block_jacobian(*view, evaluation, state, static_cast<std::size_t>(mount - view->blocks().begin()));
    equations[view->sensor()][*view->station()].add(
        {jacobian.transpose() * jacobian, jacobian.transpose() * evaluation.residuals});
  }
  return equations;
}

struct Split {
  std::size_t sensor = 0;
  std::size_t first_station = 0;
  double gain = 0;
};

Split best_split(const std::vector<std::vector<MountEquations>>& equations) {
  Split best;
  for (std::size_t s = 0; s < equations.size(); ++s) {
    std::vector<std::size_t> seen;
    for (std::size_t k = 0; k < equations[s].size(); ++k) {
      if (!equations[s][k].information.isZero()) seen.push_back(k);
    }
    for (std::size_t i = kLeastStations; i + kLeastStations <= seen.size(); ++i) {
      MountEquations before, after;
      for (std::size_t k = 0; k < seen.size(); ++k) (k < i ? before : after).add(equations[s][seen[k]]);
      const double gain = before.gain() + after.gain();
      if (gain > best.gain) best = {s, seen[i], gain};
    }
  }
  return best;
}

double led_squares(const BundleResult& bundle) {
  double sum = 0;
  for (const ViewSummary& view : bundle.views) {
    if (view.kind == View::Kind::leds) sum += view.residuals_px.squaredNorm();
  }
  return sum;
}

// As a tracker with two places.
Expected<BundleResult> refine_split(const CalibrationData& data, const Calibration& calibration, const Split& split,
                                    int threads) {
  CalibrationState state = calibration.bundle.state;
  Sensor moved = state.rig.sensors[split.sensor];
  moved.name += " moved";
  if (!moved.lens_of) moved.lens_of = split.sensor;
  const std::size_t index = state.rig.sensors.size();
  state.rig.sensors.push_back(moved);
  Observations observations = data.observations;
  for (LedView& view : observations.leds) {
    if (view.sensor == split.sensor && view.station && *view.station >= split.first_station) view.sensor = index;
  }
  BundleOptions options{.estimate_warp = calibration.warp_estimated,
                        .corner_inflation = calibration.inflation.corners,
                        .stripe_inflation = calibration.inflation.stripes,
                        .priors = calibration.priors,
                        .threads = threads};
  return refine(state, observations, options);
}

}  // namespace

std::optional<MovedSensor> find_moved_sensor(const CalibrationData& data, const Calibration& calibration, int threads) {
  const CalibrationState& state = calibration.bundle.state;
  const Split split = best_split(mount_equations(data.observations, state));
  const double before = led_squares(calibration.bundle);
  if (!(split.gain > 0)) return std::nullopt;
  const auto refined = refine_split(data, calibration, split, threads);
  if (!refined || led_squares(*refined) > kLeftOver * before) return std::nullopt;
  const BlockId first{BlockId::Kind::mount, split.sensor}, second{BlockId::Kind::mount, state.rig.sensors.size()};
  MovedSensor moved{split.sensor, split.first_station, {}, {}};
  moved.step = local_step(refined->state.rig.sensors[first.index].sensor_from_mount,
                          refined->state.rig.sensors[second.index].sensor_from_mount);
  const Eigen::MatrixXd joint = refined->covariance.of({first, second}, refined->state);
  Matrix6d covariance = joint.topLeftCorner<6, 6>() + joint.bottomRightCorner<6, 6>();
  covariance -= joint.topRightCorner<6, 6>() + joint.bottomLeftCorner<6, 6>();
  const double statistic = std::sqrt(moved.step.dot(Vector6d(solve_symmetric(covariance, moved.step))) / 6);
  if (!(statistic > kSignificant)) return std::nullopt;
  const std::string& station = data.station_names[split.first_station];
  moved.sentence = fmt::format(
      "{} stood elsewhere from station {} on (by {:.3g} mm and {:.3g} deg): if it was moved, list it in capture.yaml "
      "as "
      "two cameras, the second with `lens_of` and its `stations`; if another camera was, the same for that one",
      state.rig.sensors[split.sensor].name, station, moved.step.tail<3>().norm(),
      moved.step.head<3>().norm() * kDegreesPerRad);
  return moved;
}

}  // namespace crumple
