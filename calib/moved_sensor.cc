#include "calib/moved_sensor.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "solvers/decompositions.h"
#include "solvers/groups.h"
#include "solvers/score_test.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastStations = 3;  // on either side
constexpr std::size_t kMostTried = 6;      // trackers and times; each is a refinement
constexpr std::size_t kLeastLeds = 3;      // that tell a place
constexpr double kLeftOver = 0.25;         // of the sum of squares
constexpr double kMostGross = 0.1;         // of the readings of LEDs, whatever moved
constexpr double kGross = 15;              // sigmas; nothing counts as farther off
constexpr double kSignificant = 5;         // standard uncertainties
// What explains nearly as much as the best: no model is so exact that a thirtieth of the misfit would decide, nor are
// fifteen units of log-likelihood much for a campaign with a fault in it.
constexpr double kAsMuch = 0.97;
constexpr double kAsLikely = 30;
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

// Where a tracker stood when it saw something; left out: what was seen nobody knows when does not tell where from.
enum class Place { before, later, untold, left_out };

// What a tracker saw in a campaign that is split by its time. Of LEDs on the probe the station tells it. A board that
// the probe saw on one side of the split alone was there then; of other boards, and of references, nothing says when
// they were seen. Those that no other sensor saw say nothing of where the tracker stood, and are left where it was.
// References that are all that is left tell a place only where there are three which two other sensors located.
class SplitPlaces {
 public:
  SplitPlaces(const Observations& observations, const Split& split) : split_(split), visits_(visits(observations)) {
    for (const CornerView& view : observations.corners) {
      if (view.sensor != split.sensor) boards_of_others_.insert(view.placement);
    }
    std::map<std::size_t, std::set<std::size_t>> others_of_led;
    for (const LedView& view : observations.leds) {
      if (view.sensor == split.sensor) continue;
      for (const std::size_t led : view.leds) others_of_led[led].insert(view.sensor);
    }
    std::set<std::size_t> located;
    for (const LedView& view : observations.leds) {
      if (view.sensor != split.sensor || view.station) continue;
      for (const std::size_t led : view.leds) {
        const auto others = others_of_led.find(led);
        if (others == others_of_led.end()) continue;
        references_ = Place::left_out;
        if (others->second.size() > 1) located.insert(led);
      }
    }
    const auto is_untold = [&](const CornerView& view) {
      return view.sensor == split.sensor && of_board(view.placement) == Place::untold;
    };
    const bool told = located.size() >= kLeastLeds ||
                      std::any_of(observations.corners.begin(), observations.corners.end(), is_untold);
    if (references_ == Place::left_out && told) references_ = Place::untold;
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
    return references_;
  }

 private:
  Split split_;
  std::map<std::size_t, std::pair<std::size_t, std::size_t>> visits_;
  std::set<std::size_t> boards_of_others_;
  Place references_ = Place::before;
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

// From which stations each sensor fixed to the world saw LEDs.
std::map<std::size_t, std::set<std::size_t>> stations_of_trackers(const Observations& observations, const Rig& rig) {
  std::map<std::size_t, std::set<std::size_t>> stations;
  for (const LedView& view : observations.leds) {
    if (view.station && rig.sensors[view.sensor].mount == Mount::world) stations[view.sensor].insert(*view.station);
  }
  return stations;
}

bool enough_on_both_sides(const std::set<std::size_t>& stations, std::size_t first_station) {
  const auto earlier = static_cast<std::size_t>(std::distance(stations.begin(), stations.lower_bound(first_station)));
  return earlier >= kLeastStations && stations.size() - earlier >= kLeastStations;
}

bool gains_more(const Split& a, const Split& b) { return a.gain > b.gain; }

bool as_good(double gain, double best) { return gain >= best - std::max(kAsLikely, (1 - kAsMuch) * best); }

// Of every reading, the square of its residual over its group's variance.
std::vector<double> standardised_squares(const ViewSummary& view, const std::map<GroupKey, double>& sigmas_px) {
  const double sigma_px = sigmas_px.at({view.sensor, view.kind});
  const int d = View::dimension_of(view.kind);
  std::vector<double> squares;
  for (Eigen::Index row = 0; row < view.residuals_px.size(); row += d) {
    squares.push_back(view.residuals_px.segment(row, d).squaredNorm() / (sigma_px * sigma_px));
  }
  return squares;
}

std::map<GroupKey, double> sigmas_of(const BundleResult& bundle) {
  std::map<GroupKey, double> sigmas_px;
  for (const GroupSummary& group : bundle.groups) sigmas_px[{group.sensor, group.kind}] = group.sigma_px;
  return sigmas_px;
}

// What a push made is mostly outliers, but many: three LEDs at three stations at the least. What lies far beyond all
// but fewer was misread, and would choose the time alone.
double most_sigmas(const BundleResult& bundle) {
  constexpr std::size_t kFewer = kLeastStations * kLeastLeds - 1;
  constexpr double kFarBeyond = 3;
  const std::map<GroupKey, double> sigmas_px = sigmas_of(bundle);
  std::vector<double> squares;
  for (const ViewSummary& view : bundle.views) {
    if (View::dimension_of(view.kind) != 2) continue;
    const std::vector<double> of_view = standardised_squares(view, sigmas_px);
    squares.insert(squares.end(), of_view.begin(), of_view.end());
  }
  std::sort(squares.begin(), squares.end(), std::greater<>());
  return kFarBeyond * std::sqrt(squares[std::min(kFewer, squares.size() - 1)]);
}

// Trackers that may have been moved at the likeliest time, the likeliest first; one may be there with several times.
struct Suspects {
  std::vector<Split> tried = {};
  std::vector<Split> too_few_stations = {};  // to be tried, but they may explain as much
};

// The split that explains most, then those of the other trackers at that time: where a tracker that was moved is one of
// two, the residuals may as well be at the other. The time is known no better than between two stations that its
// tracker read LEDs from; the other may have read from one between.
Suspects find_suspects(const CalibrationData& data, const Calibration& calibration, int threads) {
  const CalibrationState& state = calibration.bundle.state;
  const auto stations = stations_of_trackers(data.observations, state.rig);
  std::vector<Split> splits;
  for (const auto& [sensor, seen] : stations) {
    for (const std::size_t station : seen) {
      if (enough_on_both_sides(seen, station)) splits.push_back({sensor, station, 0});
    }
  }
  if (splits.empty()) return {};
  const auto tester = ScoreTester::create(data.observations, calibration.bundle, options_of(calibration, threads),
                                          most_sigmas(calibration.bundle));
  if (!tester) return {};
  const auto rate = [&](Split& split) {
    split.gain = tester->test(by_places(*tester, data.observations, state, split)).gain;
  };
  std::for_each(splits.begin(), splits.end(), rate);
  const Split best = *std::min_element(splits.begin(), splits.end(), gains_more);
  if (!(best.gain > 0)) return {};
  const std::set<std::size_t>& read = stations.at(best.sensor);
  const std::size_t last_before = *std::prev(read.find(best.first_station));
  Suspects suspects;
  for (const auto& [sensor, seen] : stations) {
    std::vector<Split> own;
    for (std::size_t station = last_before + 1; station <= best.first_station; ++station) {
      if (station != best.first_station && !seen.contains(station)) continue;
      own.push_back({sensor, station, 0});
      rate(own.back());
    }
    const Split likeliest = *std::min_element(own.begin(), own.end(), gains_more);
    if (enough_on_both_sides(seen, likeliest.first_station)) {
      std::erase_if(own,
                    [&seen = seen](const Split& split) { return !enough_on_both_sides(seen, split.first_station); });
      suspects.tried.insert(suspects.tried.end(), own.begin(), own.end());
    } else if (as_good(likeliest.gain, best.gain)) {
      suspects.too_few_stations.push_back(likeliest);
    }
  }
  std::stable_sort(suspects.tried.begin(), suspects.tried.end(), gains_more);
  if (suspects.tried.size() > kMostTried) suspects.tried.resize(kMostTried);
  return suspects;
}

// Sensors on the probe that saw boards from enough stations on both sides: a camera that moved against the LEDs looks
// like a tracker that did.
std::vector<Split> splits_on_probe(const Observations& observations, const Rig& rig, std::size_t first_station) {
  std::vector<Split> splits;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    if (rig.sensors[s].mount != Mount::probe || rig.sensors[s].kind != SensorKind::camera) continue;
    std::set<std::size_t> stations;
    for (const CornerView& view : observations.corners) {
      if (view.sensor == s && view.station) stations.insert(*view.station);
    }
    if (enough_on_both_sides(stations, first_station)) splits.push_back({s, first_station, 0});
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

// As a sensor with two places; a tracker with a third one for what it saw nobody knows when, of which `left_out` takes
// no part. References that too few others see then stay where they are.
Expected<BundleResult> refine_split(const CalibrationData& data, const Calibration& calibration, const Split& split,
                                    const std::function<bool(const LedView&)>& left_out, int threads) {
  CalibrationState state = calibration.bundle.state;
  const std::size_t later = state.rig.sensors.size();
  Sensor moved = state.rig.sensors[split.sensor];
  if (!moved.lens_of) moved.lens_of = split.sensor;
  const std::string name = moved.name;
  for (const char* const place : {" later", " untold"}) {
    moved.name = name + place;
    state.rig.sensors.push_back(moved);
  }
  BundleOptions options = options_of(calibration, threads);
  Observations observations = data.observations;
  for (const LedView& view : observations.leds) {
    if (left_out(view)) options.dispensable_leds.insert(view.leds.begin(), view.leds.end());
  }
  std::erase_if(observations.leds, left_out);
  return refine(state, split_observations(std::move(observations), split, moved.mount, later, later + 1), options);
}

// Of the readings that count after the split, and of the same before it. Of the others, which are gross whatever moved,
// one would outweigh a push; but where there are many it is no explanation.
bool explains_leds(const std::vector<ViewSummary>& before, const std::vector<ViewSummary>& after) {
  double square_before = 0, square_after = 0, readings = 0, gross = 0;
  for (std::size_t v = 0; v < after.size(); ++v) {
    if (after[v].kind != View::Kind::leds) continue;
    for (std::size_t i = 0; i < after[v].inlier.size(); ++i) {
      const auto row = 2 * static_cast<Eigen::Index>(i);
      ++readings;
      if (!after[v].inlier[i]) {
        ++gross;
        continue;
      }
      square_before += before[v].residuals_px.segment<2>(row).squaredNorm();
      square_after += after[v].residuals_px.segment<2>(row).squaredNorm();
    }
  }
  return gross <= kMostGross * readings && square_after <= kLeftOver * square_before;
}

// Twice the negative logarithm of the likelihood, but for a constant, of all readings; what is gross whatever moved
// costs the same before and after.
double misfit(const std::vector<ViewSummary>& views, const std::map<GroupKey, double>& sigmas_px) {
  double sum = 0;
  for (const ViewSummary& view : views) {
    const double sigma_px = sigmas_px.at({view.sensor, view.kind});
    sum += 2 * static_cast<double>(view.residuals_px.size()) * std::log(sigma_px);
    for (const double square : standardised_squares(view, sigmas_px)) sum += std::min(square, kGross * kGross);
  }
  return sum;
}

struct Explanation {
  Split split;
  double gain = 0;  // of misfit
  Vector6d step = Vector6d::Zero();
  SensorStep told;
};

std::optional<Explanation> explanation(const CalibrationData& data, const Calibration& calibration, const Split& split,
                                       int threads) {
  const SplitPlaces places(data.observations, split);
  const auto left_out = [&](const auto& view) {
    return view.sensor == split.sensor && places.of_leds(view.station) == Place::left_out;
  };
  const auto refined = refine_split(data, calibration, split, left_out, threads);
  if (!refined) return std::nullopt;
  std::vector<ViewSummary> before = calibration.bundle.views;  // in the order of those after
  std::erase_if(before, [&](const ViewSummary& view) { return view.kind == View::Kind::leds && left_out(view); });
  if (!explains_leds(before, refined->views)) return std::nullopt;
  const BlockId first{BlockId::Kind::mount, split.sensor};
  const BlockId second{BlockId::Kind::mount, calibration.bundle.state.rig.sensors.size()};
  const auto& sensors = refined->state.rig.sensors;
  const Vector6d step = local_step(sensors[first.index].sensor_from_mount, sensors[second.index].sensor_from_mount);
  const Eigen::MatrixXd joint = refined->covariance.of({first, second}, refined->state);
  Matrix6d covariance = joint.topLeftCorner<6, 6>() + joint.bottomRightCorner<6, 6>();
  covariance -= joint.topRightCorner<6, 6>() + joint.bottomLeftCorner<6, 6>();
  const double statistic = std::sqrt(step.dot(Vector6d(solve_symmetric(covariance, step))) / 6);
  if (!(statistic > kSignificant)) return std::nullopt;
  const double gain = misfit(before, sigmas_of(calibration.bundle)) - misfit(refined->views, sigmas_of(*refined));
  return Explanation{split, gain, step, SensorStep(sensors[first.index], sensors[second.index])};
}

bool is_on_probe(const Rig& rig, const Split& split) { return rig.sensors[split.sensor].mount == Mount::probe; }

constexpr const char* kStoodElsewhere = "stood elsewhere";

std::string clause_of(const std::string& sensor, const char* how, const std::string& first_station,
                      const SensorStep& step) {
  return fmt::format("{} {} from station {} on (by {:.3g} mm and {:.3g} deg)", sensor, how, first_station,
                     step.place_mm, step.turn_rad * kDegreesPerRad);
}

// Of what explains equally much, the trackers first.
std::string sentence_of(const std::vector<Explanation>& equally_good, const std::vector<Split>& too_few_stations,
                        const Rig& rig, const std::vector<std::string>& station_names) {
  std::vector<std::string> moves;
  for (const Explanation& one : equally_good) {
    const char* const how = is_on_probe(rig, one.split) ? "came loose from the LEDs" : kStoodElsewhere;
    moves.push_back(
        clause_of(rig.sensors[one.split.sensor].name, how, station_names[one.split.first_station], one.told));
  }
  for (const Split& split : too_few_stations) {
    moves.push_back(
        fmt::format("{} stood elsewhere from station {} on (it read LEDs from too few stations to tell by how much)",
                    rig.sensors[split.sensor].name, station_names[split.first_station]));
  }
  const bool alone = moves.size() == 1;
  return fmt::format("{}{}: {}list {} in capture.yaml as two cameras, the second with `lens_of` and its `stations`{}",
                     alone ? "" : "either ", fmt::join(moves, " or "),
                     alone ? "if it was moved, " : "these observations do not tell which; ",
                     alone ? "it" : "the tracker that was moved",
                     is_on_probe(rig, equally_good.back().split)
                         ? "; a camera that came loose: fasten it and take the campaign again"
                         : "");
}

}  // namespace

SensorStep::SensorStep(const Sensor& before, const Sensor& after)
    : place_mm((after.sensor_from_mount.inverse().translation - before.sensor_from_mount.inverse().translation).norm()),
      turn_rad(local_step(before.sensor_from_mount, after.sensor_from_mount).head<3>().norm()) {}

std::string moved_clause(const std::string& sensor, const std::string& first_station, const SensorStep& step) {
  return clause_of(sensor, kStoodElsewhere, first_station, step);
}

std::optional<MovedSensor> find_moved_sensor(const CalibrationData& data, const Calibration& calibration, int threads) {
  const Rig& rig = calibration.bundle.state.rig;
  const auto [trackers, too_few_stations] = find_suspects(data, calibration, threads);
  if (trackers.empty()) return std::nullopt;
  std::vector<Split> splits = splits_on_probe(data.observations, rig, trackers.front().first_station);
  splits.insert(splits.begin(), trackers.begin(), trackers.end());
  std::vector<Explanation> found;  // of each sensor its best
  double most = 0;
  for (const Split& split : splits) {
    const auto one = explanation(data, calibration, split, threads);
    if (!one) continue;
    const auto same = std::find_if(found.begin(), found.end(),
                                   [&](const Explanation& other) { return other.split.sensor == split.sensor; });
    if (same == found.end()) {
      found.push_back(*one);
    } else if (one->gain > same->gain) {
      *same = *one;
    }
    most = std::max(most, one->gain);
  }
  std::erase_if(found, [&](const Explanation& one) { return !(one.gain > 0) || !as_good(one.gain, most); });
  std::stable_sort(found.begin(), found.end(), [&](const Explanation& a, const Explanation& b) {
    return std::pair(is_on_probe(rig, a.split), -a.gain) < std::pair(is_on_probe(rig, b.split), -b.gain);
  });
  if (found.empty() || is_on_probe(rig, found.front().split)) return std::nullopt;
  MovedSensor moved{found.front().split.sensor, found.front().split.first_station, found.front().step, {}, {}};
  for (std::size_t i = 1; i < found.size(); ++i) moved.or_else.push_back(found[i].split.sensor);
  for (const Split& split : too_few_stations) moved.or_else.push_back(split.sensor);
  moved.sentence = sentence_of(found, too_few_stations, rig, data.station_names);
  return moved;
}

}  // namespace crumple
