#include "calib/calibrate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "calib/correlation.h"
#include "calib/initial_system.h"
#include "calib/kept_parts.h"
#include "calib/lens_prior.h"
#include "calib/rig_prior.h"
#include "calib/start_from_rig.h"
#include "calib/weighting.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kFlatBoards = 1e-3;  // the probability that flat boards seem warped

Expected<CalibrationState> closed_form_cameras(const CalibrationData& data) {
  return initial_cameras(data.sensors, nominal_boards(data), data.board_of, data.observations.corners,
                         data.placement_names);
}

void add_weak_priors(const CalibrationData& data, const CalibrationState& start, BundleOptions& options) {
  for (Prior& prior : lens_priors(start)) options.priors.push_back(std::move(prior));
  if (data.may_be_open) options.priors.push_back(whole_rig_prior(start));
}

// Holds distortion to what lenses have. Few corners in the middle of the image leave the high orders free, and a
// polynomial that folds near the image's edge has no ray for what the projector shows there.
Expected<void> add_start_priors(const CalibrationState& start, BundleOptions& options) {
  constexpr int kCore = 4;
  constexpr double kDistortionSigma = 0.2;
  for (std::size_t s = 0; s < start.rig.sensors.size(); ++s) {
    const Lens& lens = start.rig.sensors[s].lens;
    if (lens.model().rfind("LENSMODEL_OPENCV", 0) != 0) continue;
    std::vector<PriorTerm> terms;
    for (int row = kCore; row < lens.parameter_count(); ++row) terms.push_back({{BlockId::Kind::lens, s}, row});
    const auto count = static_cast<Eigen::Index>(terms.size());
    CalibrationState undistorted = start;
    std::vector<double> parameters = lens.parameters();
    std::fill(parameters.begin() + kCore, parameters.end(), 0);
    undistorted.rig.sensors[s].lens = lens.with_parameters(parameters);
    auto prior = Prior::create(start.rig.sensors[s].name + ".start", std::move(terms), undistorted,
                               kDistortionSigma * kDistortionSigma * Eigen::MatrixXd::Identity(count, count));
    if (!prior) return tl::unexpected(prior.error());
    options.priors.push_back(std::move(*prior));
  }
  return {};
}

// The cameras alone, refined: the projector's start wants lenses and board poses that are right to a fraction of a
// pixel.
Expected<CalibrationState> start_cameras(const CalibrationData& data, BundleOptions options) {
  auto state = closed_form_cameras(data);
  if (!state) return state;
  Observations corners{data.observations.placement_count, data.observations.corners, {}, {}};
  add_weak_priors(data, *state, options);
  if (const auto added = add_start_priors(*state, options); !added) return tl::unexpected(added.error());
  auto refined = refine(*state, corners, options);
  if (!refined) return tl::unexpected(refined.error());
  return std::move(refined->state);
}

bool has_projector(const CalibrationData& data) {
  for (const SensorSpec& sensor : data.sensors) {
    if (sensor.kind == SensorKind::projector) return true;
  }
  return false;
}

double wald_statistic(const BundleResult& bundle, const std::set<std::size_t>& boards) {
  const CalibrationState& state = bundle.state;
  std::vector<BlockId> blocks;
  for (const std::size_t b : boards) blocks.push_back({BlockId::Kind::warp, b});
  Eigen::VectorXd warp(2 * static_cast<Eigen::Index>(blocks.size()));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    warp.segment<2>(2 * static_cast<Eigen::Index>(i)) = state.boards[blocks[i].index].warp_mm;
  }
  return warp.dot(solve_symmetric(bundle.covariance.of(blocks, state), warp).col(0));
}

// P(chi-square of 2 n degrees of freedom > x) = exp(-x/2) sum_{k < n} (x/2)^k / k!.
bool significant(double statistic, std::size_t boards) {
  double term = std::exp(-statistic / 2), sum = 0;
  for (std::size_t k = 0; k < boards; ++k) {
    sum += term;
    term *= statistic / 2 / static_cast<double>(k + 1);
  }
  return sum < kFlatBoards;
}

// The final refinement, with the board bent or flat as was chosen or as is significant.
Expected<Calibration> refine_shape(const CalibrationState& start, const Observations& observations, WarpChoice warp,
                                   BundleOptions options) {
  double statistic = 0;
  if (warp != WarpChoice::off) {
    options.estimate_warp = true;
    const std::set<std::size_t> seen(start.board_of.begin(), start.board_of.end());
    auto bent = refine(start, observations, options);
    // A board whose warp cannot be told from the lens is taken as flat unless the warp was asked for.
    if (!bent && warp == WarpChoice::on) return tl::unexpected(bent.error());
    statistic = bent ? wald_statistic(*bent, seen) : 0;
    if (warp == WarpChoice::on || significant(statistic, seen.size())) {
      return Calibration{
          .start = start, .bundle = std::move(*bent), .warp_estimated = true, .warp_statistic = statistic};
    }
  }
  CalibrationState flat_start = start;
  for (Board& board : flat_start.boards) board.warp_mm.setZero();
  options.estimate_warp = false;
  auto flat = refine(flat_start, observations, options);
  if (!flat) return tl::unexpected(flat.error());
  return Calibration{.start = start, .bundle = std::move(*flat), .warp_statistic = statistic};
}

Expected<CalibrationState> start_of(const CalibrationData& data, const CalibrationOptions& options) {
  if (options.earlier) return start_from_rig(data, options.earlier->rig, options.earlier->board_scales);
  return data.station_names.empty() ? closed_forms(data, options.bundle) : stage_by_stage(data, options);
}

// What is known without an earlier rig: weak priors of lenses, and certificates.
void add_knowledge(const CalibrationData& data, const CalibrationState& start, BundleOptions& options) {
  add_weak_priors(data, start, options);
  for (Prior& prior : scale_priors(data, start)) options.priors.push_back(std::move(prior));
}

bool knows_led(const Rig& rig, const std::string& name) {
  return std::any_of(rig.leds.begin(), rig.leds.end(), [&](const Led& led) { return led.name == name; });
}

// Sensors, LEDs and boards' sizes, what was not observed among them.
std::set<BlockId> parts_of(const CalibrationState& state) {
  std::set<BlockId> parts;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    if (!state.rig.sensors[s].lens_of) parts.insert({BlockId::Kind::lens, s});
    parts.insert({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) parts.insert({BlockId::Kind::led, l});
  for (std::size_t b = 0; b < state.boards.size(); ++b) parts.insert({BlockId::Kind::scale, b});
  return parts;
}

// With the certificates and bars alone that count beside an earlier rig: those of boards and LEDs that it does not
// know.
CalibrationData newly_certified(CalibrationData data, const Rig& earlier) {
  const std::set<std::string> rows(earlier.covariance.names.begin(), earlier.covariance.names.end());
  for (BoardSpec& board : data.boards) {
    if (rows.contains(board.name + ".scale")) board.certificate.reset();
  }
  std::erase_if(data.bars,
                [&](const ScaleBar& bar) { return knows_led(earlier, data.leds[bar.places.front().first].name); });
  return data;
}

// What is not to be corrected. Bars are put down elsewhere each time: their ends are none of it.
std::set<BlockId> kept_blocks(const CalibrationData& data, const EarlierRig& earlier, const CalibrationState& start) {
  std::set<BlockId> kept;
  if (earlier.corrected.empty()) return kept;
  const Rig known = without_bars(earlier.rig, data);
  for (std::size_t s = 0; s < start.rig.sensors.size(); ++s) {
    const std::string& name = start.rig.sensors[s].name;
    if (!earlier.rig.find(name) || earlier.corrected.contains(name)) continue;
    kept.insert({BlockId::Kind::lens, s});
    kept.insert({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < start.rig.leds.size() && !earlier.corrected.contains("leds"); ++l) {
    if (knows_led(known, start.rig.leds[l].name)) kept.insert({BlockId::Kind::led, l});
  }
  return kept;
}

// What an earlier rig knows; certificates only of boards and bars that it does not.
Expected<void> add_earlier(const CalibrationData& data, const EarlierRig& earlier, const CalibrationState& start,
                           BundleOptions& options) {
  auto known = rig_prior(without_bars(earlier.rig, data), start, data.observations, {}, parts_of(start));
  if (!known) return tl::unexpected(known.error());
  options.priors.push_back(std::move(known->prior));
  options.held.insert(known->held.begin(), known->held.end());
  options.freed.insert(known->freed.begin(), known->freed.end());
  options.held.merge(kept_blocks(data, earlier, start));
  for (Prior& prior : scale_priors(newly_certified(data, earlier.rig), start)) {
    options.priors.push_back(std::move(prior));
  }
  return {};
}

// By certificates and bars or, where there are none, by what an earlier rig knows. What that lacks stays missing.
std::optional<ScaleUncertainty> known_scale(const CalibrationData& data, const Calibration& calibration) {
  const std::optional<EarlierRig>& earlier = calibration.earlier;
  std::optional<ScaleUncertainty> scale =
      scale_uncertainty(data, calibration.bundle.state, whole_covariance(calibration));
  if (!earlier) return scale;
  if (!scale) scale = scale_uncertainty(rig_covariance(calibration));
  if (scale) scale->lacks = scale_lacks(newly_certified(data, earlier->rig), earlier->rig.scale_lacks);
  return scale;
}

template <typename V>
std::vector<V> without(const std::vector<V>& views, std::size_t placement) {
  std::vector<V> kept;
  for (V view : views) {
    if (view.placement == placement) continue;
    if (view.placement > placement) --view.placement;
    kept.push_back(std::move(view));
  }
  return kept;
}

}  // namespace

Expected<CalibrationState> closed_forms(const CalibrationData& data, const BundleOptions& options) {
  if (!data.station_names.empty()) {
    return initial_system(data, [&](const CalibrationData& part) { return closed_forms(part, options); });
  }
  BundleOptions flat = options;
  flat.estimate_warp = false;
  Expected<CalibrationState> start = has_projector(data) ? start_cameras(data, flat) : closed_form_cameras(data);
  if (!start) return start;
  if (const auto added = add_initial_projectors(data.pairs, *start); !added) return tl::unexpected(added.error());
  return start;
}

Expected<CalibrationState> stage_by_stage(const CalibrationData& data, const CalibrationOptions& options) {
  return initial_system(data, [&](const CalibrationData& part) -> Expected<CalibrationState> {
    auto calibration = calibrate(part, options);
    if (!calibration) return tl::unexpected(calibration.error());
    return std::move(calibration->bundle.state);
  });
}

Expected<Calibration> calibrate(const CalibrationData& data, const CalibrationOptions& options) {
  BundleOptions bundle_options = options.bundle;
  bundle_options.estimate_warp = false;
  const Expected<CalibrationState> start = start_of(data, options);
  if (!start) return tl::unexpected(start.error());
  if (options.earlier) {
    const auto added = add_earlier(data, *options.earlier, *start, bundle_options);
    if (!added) return tl::unexpected(added.error());
  } else {
    add_knowledge(data, *start, bundle_options);
  }

  bundle_options.estimate_warp = options.warp != WarpChoice::off;
  auto independent = refine(*start, data.observations, bundle_options);
  if (!independent && options.warp == WarpChoice::automatic) {
    bundle_options.estimate_warp = false;
    independent = refine(*start, data.observations, bundle_options);
  }
  if (!independent) return tl::unexpected(independent.error());
  const Inflation counted = inflation(data.observations, *independent, bundle_options.threads);
  bundle_options.corner_inflation = counted.corners;
  bundle_options.stripe_inflation = counted.stripes;
  auto calibration = refine_shape(independent->state, data.observations, options.warp, bundle_options);
  if (!calibration) return calibration;
  calibration->placement_names = data.placement_names;
  calibration->station_names = data.station_names;
  calibration->start = *start;
  calibration->inflation = counted;
  calibration->priors = bundle_options.priors;
  add_weighting(data.observations, bundle_options, *calibration);
  calibration->earlier = options.earlier;
  if (options.earlier && !options.earlier->corrected.empty()) {
    auto whole = covariance_with_kept(data.observations, *calibration, kept_blocks(data, *options.earlier, *start),
                                      bundle_options.threads);
    if (!whole) return tl::unexpected(whole.error());
    calibration->with_kept = std::move(*whole);
  }
  calibration->scale = known_scale(data, *calibration);
  return calibration;
}

CalibrationData without_placement(const CalibrationData& data, std::size_t placement) {
  CalibrationData rest = data;
  rest.placement_names.erase(rest.placement_names.begin() + static_cast<std::ptrdiff_t>(placement));
  rest.board_of.erase(rest.board_of.begin() + static_cast<std::ptrdiff_t>(placement));
  rest.observations.placement_count = rest.placement_names.size();
  rest.observations.corners = without(data.observations.corners, placement);
  rest.observations.stripes = without(data.observations.stripes, placement);
  rest.observations.features = without(data.observations.features, placement);
  rest.pairs = without(data.pairs, placement);
  return rest;
}

std::string place_name(const Calibration& calibration, const ViewSummary& view) {
  if (view.placement) return calibration.placement_names[*view.placement];
  return view.station ? calibration.station_names[*view.station] : "room";
}

const JointCovariance& whole_covariance(const Calibration& calibration) {
  return calibration.with_kept ? *calibration.with_kept : calibration.bundle.covariance;
}

RigCovariance rig_covariance(const BundleResult& bundle) { return bundle.covariance.of_rig_and(bundle.body_motions); }

RigCovariance rig_covariance(const Calibration& calibration) {
  return whole_covariance(calibration).of_rig_and(calibration.bundle.body_motions);
}

Rig calibrated_rig(const Calibration& calibration) {
  Rig rig = calibration.bundle.state.rig;
  rig.covariance = rig_covariance(calibration);
  if (calibration.earlier) rig.sigma_px = calibration.earlier->rig.sigma_px;  // of what was not observed this time
  for (const GroupSummary& group : calibration.bundle.groups) {
    rig.sigma_px[group_name(rig, group.sensor, group.kind)] = group.sigma_px;
  }
  if (calibration.scale) rig.scale_lacks = calibration.scale->lacks;
  return rig;
}

}  // namespace crumple
