#include "calib/refine_stations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/rig_prior.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kMatchingRounds = 2;
constexpr double kContradictionSigmas = 5;

// Two stations with the patches they share.
struct SharedSurface {
  std::size_t here = 0;
  std::size_t there = 0;
};

CalibrationState state_of(const Rig& rig, const std::vector<ObservedStation>& stations,
                          const std::vector<RoomTarget>& targets) {
  CalibrationState state{.rig = rig, .boards = {}, .world_from_board = {}, .board_of = {}, .world_from_probe = {}};
  for (const RoomTarget& target : targets) state.rig.leds.push_back({target.name, target.position_mm, Mount::world});
  for (const ObservedStation& station : stations) state.world_from_probe.push_back(station.world_from_probe);
  return state;
}

Observations led_observations(const std::vector<ObservedStation>& stations) {
  Observations observations;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    for (const LedReading& reading : stations[s].readings) {
      LedView view = reading.view;
      view.station = s;
      if (!view.leds.empty()) observations.leds.push_back(std::move(view));
    }
  }
  return observations;
}

Expected<void> check_targets(const Rig& rig, const std::vector<ObservedStation>& stations,
                             const std::vector<RoomTarget>& targets) {
  for (const ObservedStation& station : stations) {
    for (const TargetReading& reading : station.targets) {
      if (reading.camera >= rig.sensors.size() || rig.sensors[reading.camera].mount != Mount::probe) {
        return fail(fmt::format("station {}: targets are seen by a sensor that is not on the probe", station.name));
      }
      if (reading.pixels.size() != reading.targets.size()) {
        return fail(fmt::format("station {}: {} targets have {} pixels", station.name, reading.targets.size(),
                                reading.pixels.size()));
      }
      for (const std::size_t target : reading.targets) {
        if (target < targets.size()) continue;
        return fail(
            fmt::format("station {} sees target {}, of {} that are given", station.name, target, targets.size()));
      }
    }
  }
  return {};
}

void add_targets(const std::vector<ObservedStation>& stations, std::size_t first_target, Observations& observations) {
  for (std::size_t s = 0; s < stations.size(); ++s) {
    for (const TargetReading& reading : stations[s].targets) {
      LedView view{reading.camera, {}, reading.pixels, s};
      for (const std::size_t target : reading.targets) view.leds.push_back(first_target + target);
      if (!view.leds.empty()) observations.leds.push_back(std::move(view));
    }
  }
}

StripePoints points_of(const StationSurface& surface, std::size_t station) {
  return {surface.camera, surface.projector, station, surface.stripe_normal, {}, {}};
}

OverlapView view_of(const StationSurface& here, std::size_t here_station, const StationSurface& there,
                    std::size_t there_station, const std::vector<PatchPair>& pairs) {
  OverlapView view{points_of(here, here_station), points_of(there, there_station), {}};
  for (const PatchPair& pair : pairs) {
    const SurfacePatch &a = here.patches[pair.here], &b = there.patches[pair.there];
    view.here.camera_pixels.push_back(a.camera_pixel);
    view.here.coordinates_px.push_back(a.coordinate_px);
    view.there.camera_pixels.push_back(b.camera_pixel);
    view.there.coordinates_px.push_back(b.coordinate_px);
    view.there_normals.push_back(b.normal);
  }
  return view;
}

// Every pair of stations once, in the order given.
std::vector<OverlapView> find_overlaps(const std::vector<ObservedStation>& stations, const std::vector<Pose>& poses,
                                       const StationRefinementOptions& options) {
  std::vector<OverlapView> views;
  for (std::size_t a = 0; a < stations.size(); ++a) {
    for (std::size_t b = a + 1; b < stations.size(); ++b) {
      for (const StationSurface& here : stations[a].surfaces) {
        for (const StationSurface& there : stations[b].surfaces) {
          const auto pairs = overlap(here.patches, there.patches, poses[b].inverse() * poses[a], options.overlap);
          if (pairs.size() >= options.least_pairs) views.push_back(view_of(here, a, there, b, pairs));
        }
      }
    }
  }
  return views;
}

// Stations that hang together by overlaps have to be told by LEDs somewhere.
Expected<void> refuse_overlap_alone(const std::vector<ObservedStation>& stations,
                                    const std::vector<OverlapView>& overlaps) {
  std::vector<std::size_t> group(stations.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (const OverlapView& view : overlaps) {
    const std::size_t from = group[view.there.station], to = group[view.here.station];
    std::replace(group.begin(), group.end(), from, to);
  }
  std::set<std::size_t> with_leds;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    const auto& readings = stations[s].readings;
    const bool any = std::any_of(readings.begin(), readings.end(), [](const auto& r) { return !r.view.leds.empty(); });
    if (any) with_leds.insert(group[s]);
  }
  for (std::size_t s = 0; s < stations.size(); ++s) {
    if (with_leds.contains(group[s])) continue;
    return fail(
        fmt::format("station {}: no LED is read there, nor at any station it shares surface with: overlap alone "
                    "does not say where stations are",
                    stations[s].name));
  }
  return {};
}

// What LEDs and rig object to a state: their sum of squares, in the sigmas and with the readings of the fit to them.
double objection(const Observations& leds, const BundleResult& fit, const Prior& rig, const CalibrationState& state) {
  double sum = rig.evaluate(state).residuals.squaredNorm();
  const auto views = make_views(leds, {});
  for (std::size_t v = 0; v < views.size(); ++v) {
    ViewEvaluation evaluation;
    if (!views[v]->evaluate(state, false, evaluation)) continue;
    const auto group = std::find_if(fit.groups.begin(), fit.groups.end(),
                                    [&](const GroupSummary& g) { return g.sensor == views[v]->sensor(); });
    for (int i = 0; i < views[v]->size(); ++i) {
      if (!fit.views[v].inlier[static_cast<std::size_t>(i)]) continue;
      sum += evaluation.residuals.segment<2>(2 * i).squaredNorm() / (group->sigma_px * group->sigma_px);
    }
  }
  return sum;
}

// How many parameters' worth the rest of the observations adds to LEDs and rig: n - tr(C_leds^-1 C).
double added_freedom(const BundleResult& by_leds, const BundleResult& all, const Observations& leds) {
  std::set<BlockId> touched;
  for (const auto& view : make_views(leds, {})) touched.insert(view->blocks().begin(), view->blocks().end());
  const std::vector<BlockId> blocks(touched.begin(), touched.end());
  const Eigen::MatrixXd before = by_leds.covariance.of(blocks, by_leds.state);
  const Eigen::MatrixXd after = all.covariance.of(blocks, by_leds.state);
  std::vector<Eigen::Index> rows;  // of what is estimated
  for (Eigen::Index i = 0; i < before.rows(); ++i) {
    if (before(i, i) > 0) rows.push_back(i);
  }
  Eigen::VectorXd scale(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    scale[static_cast<Eigen::Index>(i)] = 1 / std::sqrt(before(rows[i], rows[i]));
  }
  const Eigen::MatrixXd a = scale.asDiagonal() * before(rows, rows) * scale.asDiagonal();
  const Eigen::MatrixXd b = scale.asDiagonal() * after(rows, rows) * scale.asDiagonal();
  return static_cast<double>(rows.size()) - solve_symmetric(a, b).trace();
}

RefinedStation summarise(std::size_t s, const BundleResult& by_leds, const BundleResult& all,
                         const std::vector<OverlapView>& overlaps) {
  const std::vector<BlockId> block{{BlockId::Kind::station, s}};
  RefinedStation station{.world_from_probe = all.state.world_from_probe[s],
                         .covariance = all.covariance.of(block, all.state),
                         .by_leds = by_leds.state.world_from_probe[s],
                         .covariance_by_leds = by_leds.covariance.of(block, by_leds.state)};
  station.shift = local_step(station.by_leds, station.world_from_probe);
  if (station.covariance_by_leds.diagonal().minCoeff() > 0) {
    const double square = station.shift.dot(Vector6d(solve_symmetric(station.covariance_by_leds, station.shift)));
    station.shift_sigmas = std::sqrt(std::max(square, 0.0) / 6);
  }
  std::set<std::size_t> others;
  for (const OverlapView& view : overlaps) {
    if (view.here.station == s) others.insert(view.there.station);
    if (view.there.station == s) others.insert(view.here.station);
  }
  station.overlaps = others.size();
  return station;
}

// There are no views before those of LEDs here.
std::set<std::size_t> leds_with_accepted_readings(const std::vector<LedView>& views, const BundleResult& bundle) {
  std::set<std::size_t> leds;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (std::size_t i = 0; i < views[v].leds.size(); ++i) {
      if (bundle.views[v].inlier[i]) leds.insert(views[v].leds[i]);
    }
  }
  return leds;
}

}  // namespace

Expected<StationRefinement> refine_stations(const Rig& rig, const std::vector<ObservedStation>& stations,
                                            const std::vector<RoomTarget>& targets,
                                            const StationRefinementOptions& options) {
  if (const auto sound = check_targets(rig, stations, targets); !sound) return tl::unexpected(sound.error());
  const CalibrationState start = state_of(rig, stations, targets);
  const Observations leds = led_observations(stations);
  Observations all = leds;
  add_targets(stations, rig.leds.size(), all);
  all.overlaps = find_overlaps(stations, start.world_from_probe, options);
  if (const auto posed = refuse_overlap_alone(stations, all.overlaps); !posed) return tl::unexpected(posed.error());

  // Targets are read as corners of boards are; of that the rig's campaign had more.
  std::map<std::string, double> known_sigma_px = rig.sigma_px;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const auto corners = rig.sigma_px.find(group_name(rig, s, View::Kind::corners));
    if (corners != rig.sigma_px.end()) known_sigma_px.emplace(group_name(rig, s, View::Kind::leds), corners->second);
  }
  BundleOptions bundle{.reject_outliers = options.reject_outliers,
                       .known_sigma_px = std::move(known_sigma_px),
                       .overlap_inflation = options.overlap_inflation,
                       .threads = options.threads};
  for (std::size_t t = 0; t < targets.size(); ++t) bundle.dispensable_leds.insert(rig.leds.size() + t);
  const auto of_leds = rig_prior(rig, start, leds);
  if (!of_leds) return tl::unexpected(of_leds.error());
  bundle.held = of_leds->held;
  bundle.priors = {of_leds->prior};
  auto by_leds = refine(of_leds->state, leds, bundle);
  if (!by_leds) return fail("stations from LEDs alone: " + by_leds.error().message);

  Expected<BundleResult> refined = *by_leds;
  for (int round = 0; round < kMatchingRounds; ++round) {
    all.overlaps = find_overlaps(stations, refined->state.world_from_probe, options);
    // What the cameras and the projector are known by comes in with the overlaps.
    const auto known = rig_prior(rig, refined->state, all);
    if (!known) return tl::unexpected(known.error());
    bundle.held = known->held;
    bundle.priors = {known->prior};
    refined = refine(refined->state, all, bundle);
    if (!refined) return fail("stations refined together: " + refined.error().message);
  }

  StationRefinement result{
      .by_leds = std::move(*by_leds), .bundle = std::move(*refined), .observations = {}, .priors = {}};
  result.contradiction_square = objection(leds, result.by_leds, of_leds->prior, result.bundle.state) -
                                objection(leds, result.by_leds, of_leds->prior, result.by_leds.state);
  const double freedom = added_freedom(result.by_leds, result.bundle, leds);
  result.contradiction_freedom = std::max(static_cast<int>(std::lround(freedom)), 1);
  if (result.contradiction_square >
      result.contradiction_freedom + kContradictionSigmas * std::sqrt(2.0 * result.contradiction_freedom)) {
    return fail(
        fmt::format("overlap and targets contradict the LEDs: the LEDs' squares grow by {:.0f} where about {} "
                    "are to be expected; something moved between stations, or what overlaps is not one surface",
                    result.contradiction_square, result.contradiction_freedom));
  }
  std::set<std::pair<std::size_t, std::size_t>> overlapping;
  for (const OverlapView& view : all.overlaps) {
    overlapping.emplace(view.here.station, view.there.station);
    result.pairs += view.there_normals.size();
  }
  result.overlaps = overlapping.size();
  for (std::size_t s = 0; s < stations.size(); ++s) {
    result.stations.push_back(summarise(s, result.by_leds, result.bundle, all.overlaps));
  }
  const std::set<std::size_t> told = leds_with_accepted_readings(all.leds, result.bundle);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const std::size_t led = rig.leds.size() + t;
    result.targets.push_back(
        told.contains(led) ? RoomTarget{targets[t].name, result.bundle.state.rig.leds[led].position_mm} : targets[t]);
    result.targets_used += told.contains(led) ? 1 : 0;
  }
  result.observations = std::move(all);
  result.priors = std::move(bundle.priors);
  return result;
}

}  // namespace crumple
