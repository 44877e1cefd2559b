#include "calib/moved_sensor.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "solvers/decompositions.h"
#include "solvers/score_test.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastStations = 3;  // on either side
constexpr std::size_t kMostTried = 4;      // trackers; each is a refinement
constexpr double kLeftOver = 0.25;         // of the sum of squares
constexpr double kSignificant = 5;         // standard uncertainties
constexpr double kAsMuch = 0.9;            // of what the best one explains
constexpr double kLeastSquare_px2 = 1e-12;
constexpr double kDegreesPerRad = 180 / std::numbers::pi;

struct Split {
  std::size_t sensor = 0;
  std::size_t first_station = 0;
  double gain = 0;
};

BundleOptions options_of(const Calibration& calibration, int threads) {
  return {.estimate_warp = calibration.warp_estimated,
          .corner_inflation = calibration.inflation.corners,
          .stripe_inflation = calibration.inflation.stripes,
          .priors = calibration.priors,
          .threads = threads};
}

// First and last station from which each placement was seen from the probe.
std::map<std::size_t, std::pair<std::size_t, std::size_t>> visits(const Observations& observations) {
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> visited;
  for (const CornerView& view : observations.corners) {
    if (!view.station) continue;
    auto& [first, last] = visited.try_emplace(view.placement, *view.station, *view.station).first->second;
    first = std::min(first, *view.station);
    last = std::max(last, *view.station);
  }
  return visited;
}

// Where a tracker stood when it saw something.
enum class Place { before, later, untold };

// What a tracker saw in a campaign that is split by its time. Of LEDs on the probe the station tells it. A board that
// the probe saw on one side of the split alone was there then; of other boards, and of references, nothing says when
// they were seen. Those that no other sensor saw say nothing of where the tracker stood, and are left where it was.
class SplitPlaces {
 public:
  SplitPlaces(const Observations& observations, const Split& split) : split_(split), visits_(visits(observations)) {
    for (const CornerView& view : observations.corners) {
      if (view.sensor != split.sensor) boards_of_others_.insert(view.placement);
    }
    for (const LedView& view : observations.leds) {
      if (view.sensor != split.sensor && !view.station) references_of_others_ = true;
    }
  }

  Place of_board(std::size_t placement) const {
    if (!boards_of_others_.contains(placement)) return Place::before;
    const auto visit = visits_.find(placement);
    if (visit == visits_.end()) return Place::untold;
    if (visit->second.second < split_.first_station) return Place::before;
    return visit->second.first >= split_.first_station ? Place::later : Place::untold;
  }
  Place of_leds(std::optional<std::size_t> station) const {
    if (station) return *station < split_.first_station ? Place::before : Place::later;
    return references_of_others_ ? Place::untold : Place::before;
  }

 private:
  Split split_;
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> visits_;
  std::set<std::size_t> boards_of_others_;
  bool references_of_others_ = false;
};

// The derivative of all that a tracker saw by its later place and by the untold one, beside each other.
ScoreTester::Columns by_places(const ScoreTester& tester, const Observations& observations,
                               const CalibrationState& state, const Split& split) {
  const SplitPlaces places(observations, split);
  ScoreTester::Columns columns;
  for (std::size_t v = 0; v < tester.views().size(); ++v) {
    const View& view = *tester.views()[v];
    if (view.sensor() != split.sensor) continue;
    const Place place = view.placement() ? places.of_board(*view.placement()) : places.of_leds(view.station());
    if (place == Place::before) continue;
    const auto& blocks = view.blocks();
    const auto mount = std::find(blocks.begin(), blocks.end(), BlockId{BlockId::Kind::mount, split.sensor});
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(view.dimension() * view.size(), 12);
    both.middleCols<6>(place == Place::later ? 0 : 6) =
        block_jacobian(view, tester.evaluation(v), state, static_cast<std::size_t>(mount - blocks.begin()));
    columns.emplace_back(v, std::move(both));
  }
  return columns;
}

// Of each sensor fixed to the world, those with which LEDs were seen from enough stations on both sides.
std::vector<Split> possible_splits(const Observations& observations, const Rig& rig) {
  std::vector<std::set<std::size_t>> stations(rig.sensors.size());
  for (const LedView& view : observations.leds) {
    if (view.station && rig.sensors[view.sensor].mount == Mount::world) stations[view.sensor].insert(*view.station);
  }
  std::vector<Split> splits;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    const std::vector<std::size_t> seen(stations[s].begin(), stations[s].end());
    for (std::size_t i = kLeastStations; i + kLeastStations <= seen.size(); ++i) splits.push_back({s, seen[i], 0});
  }
  return splits;
}

bool gains_more(const Split& a, const Split& b) { return a.gain > b.gain; }

// The one that explains most, then those of the other trackers at that time: where a tracker that was moved is one of
// two, the residuals may as well be at the other.
std::vector<Split> promising_splits(const CalibrationData& data, const Calibration& calibration, int threads) {
  constexpr double kAll = 1e9;  // sigmas: what the fault made is mostly outliers
  const CalibrationState& state = calibration.bundle.state;
  std::vector<Split> splits = possible_splits(data.observations, state.rig);
  if (splits.empty()) return {};
  const auto tester =
      ScoreTester::create(data.observations, calibration.bundle, options_of(calibration, threads), kAll);
  if (!tester) return {};
  for (Split& split : splits) split.gain = tester->test(by_places(*tester, data.observations, state, split)).gain;
  std::stable_sort(splits.begin(), splits.end(), gains_more);
  if (!(splits.front().gain > 0)) return {};
  const std::size_t first_station = splits.front().first_station;
  std::erase_if(splits, [&](const Split& split) { return split.first_station != first_station; });
  if (splits.size() > kMostTried) splits.resize(kMostTried);
  return splits;
}

// Sensors on the probe that saw boards from enough stations on both sides: a camera that moved against the LEDs looks
// like a tracker that did.
std::vector<Split> splits_on_probe(const Observations& observations, const Rig& rig, std::size_t first_station) {
  std::vector<Split> splits;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    if (rig.sensors[s].mount != Mount::probe || rig.sensors[s].kind != SensorKind::camera) continue;
    std::set<std::size_t> earlier, later;
    for (const CornerView& view : observations.corners) {
      if (view.sensor != s || !view.station) continue;
      (*view.station < first_station ? earlier : later).insert(*view.station);
    }
    if (earlier.size() >= kLeastStations && later.size() >= kLeastStations) splits.push_back({s, first_station, 0});
  }
  return splits;
}

// What a sensor saw before the split stays its own. The numbers of its other places are `later` and, of a tracker,
// `untold`.
Observations split_observations(Observations observations, const Split& split, Mount mount, std::size_t later,
                                std::size_t untold) {
  if (mount == Mount::probe) {
    const auto reassign = [&](std::size_t& sensor, const std::optional<std::size_t>& station) {
      if (sensor == split.sensor && station && *station >= split.first_station) sensor = later;
    };
    for (CornerView& view : observations.corners) reassign(view.sensor, view.station);
    for (StripeView& view : observations.stripes) reassign(view.camera, view.station);
    for (FeatureView& view : observations.features) reassign(view.camera, view.station);
    for (LedView& view : observations.leds) reassign(view.sensor, view.station);
    return observations;
  }
  const SplitPlaces places(observations, split);
  const auto reassign = [&](std::size_t& sensor, Place place) {
    if (sensor != split.sensor || place == Place::before) return;
    sensor = place == Place::later ? later : untold;
  };
  for (CornerView& view : observations.corners) reassign(view.sensor, places.of_board(view.placement));
  for (LedView& view : observations.leds) reassign(view.sensor, places.of_leds(view.station));
  return observations;
}

// As a sensor with two places; a tracker with a third one for what it saw nobody knows when.
Expected<BundleResult> refine_split(const CalibrationData& data, const Calibration& calibration, const Split& split,
                                    int threads) {
  CalibrationState state = calibration.bundle.state;
  const std::size_t later = state.rig.sensors.size();
  Sensor moved = state.rig.sensors[split.sensor];
  if (!moved.lens_of) moved.lens_of = split.sensor;
  const std::string name = moved.name;
  for (const char* const place : {" later", " untold"}) {
    moved.name = name + place;
    state.rig.sensors.push_back(moved);
  }
  return refine(state, split_observations(data.observations, split, moved.mount, later, later + 1),
                options_of(calibration, threads));
}

double led_squares(const BundleResult& bundle) {
  double sum = 0;
  for (const ViewSummary& view : bundle.views) {
    if (view.kind == View::Kind::leds) sum += view.residuals_px.squaredNorm();
  }
  return sum;
}

// Twice the negative logarithm of the likelihood, but for a constant, of all residuals: each group's variance is its
// mean square. Places of one sensor are one group.
double misfit(const BundleResult& bundle) {
  struct Group {
    double count = 0, square = 0;
  };
  std::map<std::pair<std::size_t, View::Kind>, Group> groups;
  for (const ViewSummary& view : bundle.views) {
    Group& group = groups[{bundle.state.rig.sensors[view.sensor].lens_of.value_or(view.sensor), view.kind}];
    group.count += static_cast<double>(view.residuals_px.size());
    group.square += view.residuals_px.squaredNorm();
  }
  double sum = 0;
  for (const auto& entry : groups) {
    const Group& group = entry.second;
    sum += group.count * std::log(std::max(group.square / group.count, kLeastSquare_px2));
  }
  return sum;
}

struct Explanation {
  Split split;
  double misfit = 0;
  Vector6d step = Vector6d::Zero();
};

std::optional<Explanation> explanation(const CalibrationData& data, const Calibration& calibration, const Split& split,
                                       int threads) {
  const auto refined = refine_split(data, calibration, split, threads);
  if (!refined || led_squares(*refined) > kLeftOver * led_squares(calibration.bundle)) return std::nullopt;
  const BlockId first{BlockId::Kind::mount, split.sensor};
  const BlockId second{BlockId::Kind::mount, calibration.bundle.state.rig.sensors.size()};
  const auto& sensors = refined->state.rig.sensors;
  const Vector6d step = local_step(sensors[first.index].sensor_from_mount, sensors[second.index].sensor_from_mount);
  const Eigen::MatrixXd joint = refined->covariance.of({first, second}, refined->state);
  Matrix6d covariance = joint.topLeftCorner<6, 6>() + joint.bottomRightCorner<6, 6>();
  covariance -= joint.topRightCorner<6, 6>() + joint.bottomLeftCorner<6, 6>();
  const double statistic = std::sqrt(step.dot(Vector6d(solve_symmetric(covariance, step))) / 6);
  if (!(statistic > kSignificant)) return std::nullopt;
  return Explanation{split, misfit(*refined), step};
}

std::string sentence_of(const std::vector<Explanation>& equally_good, const Rig& rig,
                        const std::vector<std::string>& station_names) {
  std::vector<std::string> moves;
  for (const Explanation& one : equally_good) {
    moves.push_back(fmt::format("{} stood elsewhere from station {} on (by {:.3g} mm and {:.3g} deg)",
                                rig.sensors[one.split.sensor].name, station_names[one.split.first_station],
                                one.step.tail<3>().norm(), one.step.head<3>().norm() * kDegreesPerRad));
  }
  const bool alone = moves.size() == 1;
  return fmt::format("{}{}: {}list {} in capture.yaml as two cameras, the second with `lens_of` and its `stations`",
                     alone ? "" : "either ", fmt::join(moves, " or "),
                     alone ? "if it was moved, " : "these observations do not tell which; ",
                     alone ? "it" : "the one that was moved");
}

}  // namespace

std::optional<MovedSensor> find_moved_sensor(const CalibrationData& data, const Calibration& calibration, int threads) {
  const Rig& rig = calibration.bundle.state.rig;
  std::vector<Split> splits = promising_splits(data, calibration, threads);
  if (splits.empty()) return std::nullopt;
  for (const Split& split : splits_on_probe(data.observations, rig, splits.front().first_station)) {
    splits.push_back(split);
  }
  std::vector<Explanation> found;
  for (const Split& split : splits) {
    if (auto one = explanation(data, calibration, split, threads)) found.push_back(*one);
  }
  if (found.empty()) return std::nullopt;
  std::stable_sort(found.begin(), found.end(),
                   [](const Explanation& a, const Explanation& b) { return a.misfit < b.misfit; });
  if (rig.sensors[found.front().split.sensor].mount == Mount::probe) return std::nullopt;
  const double before = misfit(calibration.bundle);
  const double enough = kAsMuch * (before - found.front().misfit);
  std::erase_if(found, [&](const Explanation& one) { return before - one.misfit < enough; });
  MovedSensor moved{found.front().split.sensor, found.front().split.first_station, found.front().step, {}, {}};
  for (std::size_t i = 1; i < found.size(); ++i) moved.or_else.push_back(found[i].split.sensor);
  moved.sentence = sentence_of(found, rig, data.station_names);
  return moved;
}

}  // namespace crumple
