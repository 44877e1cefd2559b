#include "calib/calibrate.h"

#include <utility>

#include <Eigen/Cholesky>

#include "calib/correlation.h"
#include "calib/lens_prior.h"

namespace crumple {
namespace {

constexpr double kSignificantWarp = 13.8;

void add_lens_priors(const CalibrationState& start, BundleOptions& options) {
  for (Prior& prior : lens_priors(start)) options.priors.push_back(std::move(prior));
}

// The cameras alone, refined: the projector's start wants lenses and board poses that are right to a fraction of a
// pixel.
Expected<CalibrationState> start_cameras(const CalibrationData& data, BundleOptions options) {
  auto state = initial_cameras(data.sensors, data.board, data.observations.corners, data.placement_names);
  if (!state) return state;
  Observations corners{data.observations.placement_count, data.observations.corners, {}, {}};
  add_lens_priors(*state, options);
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

double wald_statistic(const BundleResult& bundle) {
  const Eigen::MatrixXd covariance = bundle.covariance.of({{BlockId::Kind::warp}}, bundle.state);
  const Eigen::VectorXd warp = bundle.state.board.warp_mm;
  return warp.dot(covariance.llt().solve(warp));
}

// The final refinement, with the board bent or flat as was chosen or as is significant.
Expected<Calibration> refine_shape(const CalibrationState& start, const Observations& observations, WarpChoice warp,
                                   BundleOptions options) {
  double statistic = 0;
  if (warp != WarpChoice::off) {
    options.estimate_warp = true;
    auto bent = refine(start, observations, options);
    // A board whose warp cannot be told from the lens is taken as flat unless the warp was asked for.
    if (!bent && warp == WarpChoice::on) return tl::unexpected(bent.error());
    statistic = bent ? wald_statistic(*bent) : 0;
    if (warp == WarpChoice::on || statistic > kSignificantWarp) {
      return Calibration{{}, start, std::move(*bent), true, statistic, options.stripe_inflation};
    }
  }
  CalibrationState flat_start = start;
  flat_start.board.warp_mm.setZero();
  options.estimate_warp = false;
  auto flat = refine(flat_start, observations, options);
  if (!flat) return tl::unexpected(flat.error());
  return Calibration{{}, start, std::move(*flat), false, statistic, options.stripe_inflation};
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

Expected<Calibration> calibrate(const CalibrationData& data, const CalibrationOptions& options) {
  BundleOptions bundle_options = options.bundle;
  bundle_options.estimate_warp = false;
  Expected<CalibrationState> start =
      has_projector(data) ? start_cameras(data, bundle_options)
                          : initial_cameras(data.sensors, data.board, data.observations.corners, data.placement_names);
  if (!start) return tl::unexpected(start.error());
  if (const auto added = add_initial_projectors(data.pairs, *start); !added) return tl::unexpected(added.error());

  add_lens_priors(*start, bundle_options);

  CalibrationState refined_start = *start;
  if (!data.observations.stripes.empty()) {
    bundle_options.estimate_warp = options.warp != WarpChoice::off;
    auto independent = refine(*start, data.observations, bundle_options);
    if (!independent) return tl::unexpected(independent.error());
    bundle_options.stripe_inflation = stripe_inflation(data.observations.stripes, *independent);
    refined_start = std::move(independent->state);
  }
  auto calibration = refine_shape(refined_start, data.observations, options.warp, bundle_options);
  if (!calibration) return calibration;
  calibration->placement_names = data.placement_names;
  calibration->start = *start;
  calibration->priors = bundle_options.priors;
  return calibration;
}

CalibrationData without_placement(const CalibrationData& data, std::size_t placement) {
  CalibrationData rest = data;
  rest.placement_names.erase(rest.placement_names.begin() + static_cast<std::ptrdiff_t>(placement));
  rest.observations.placement_count = rest.placement_names.size();
  rest.observations.corners = without(data.observations.corners, placement);
  rest.observations.stripes = without(data.observations.stripes, placement);
  rest.observations.features = without(data.observations.features, placement);
  rest.pairs = without(data.pairs, placement);
  return rest;
}

RigCovariance rig_covariance(const BundleResult& bundle) {
  return {bundle.covariance.names(), bundle.covariance.common()};
}

Rig calibrated_rig(const Calibration& calibration) {
  Rig rig = calibration.bundle.state.rig;
  rig.covariance = rig_covariance(calibration.bundle);
  for (const GroupSummary& group : calibration.bundle.groups) {
    rig.sigma_px[group_name(rig, group.sensor, group.kind)] = group.sigma_px;
  }
  return rig;
}

}  // namespace crumple
