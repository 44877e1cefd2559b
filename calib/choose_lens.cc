#include "calib/choose_lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/board_pose.h"
#include "calib/system_part.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr std::array<const char*, 5> kLadder{"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5",
                                             "LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12"};
constexpr std::size_t kFolds = 5;
constexpr std::size_t kFewestPlacements = 4;
constexpr std::size_t kReadingsPerView = 300;  // of a projector's stripes; more only cost time
constexpr double kNormalQuantile = 3.0902;     // of one in a thousand, one-sided

// What a chi-square variable exceeds once in a thousand times (Wilson & Hilferty 1931).
double chi_square_limit(double degrees) {
  const double spread = 2 / (9 * degrees);
  return degrees * std::pow(1 - spread + kNormalQuantile * std::sqrt(spread), 3);
}

// The sums of squares of held-out residuals, by placement.
struct Squares {
  double sum = 0;
  std::size_t count = 0;
};

struct Trial {
  LensCandidate candidate;
  std::optional<Calibration> calibration;  // of all placements
  std::vector<Calibration> folds;
  std::map<std::size_t, Squares> held_out;
};

bool judged_by(const View& view, SensorKind kind) {
  return (view.kind() == View::Kind::corners) == (kind == SensorKind::camera);
}

CalibrationData with_model(CalibrationData data, SensorKind kind, const std::optional<Mount>& mount,
                           const std::string& model) {
  for (SensorSpec& sensor : data.sensors) {
    if (sensor.kind == kind && (!mount || sensor.mount == *mount)) sensor.lens_model = model;
  }
  return data;
}

CalibrationData cameras_alone(const CalibrationData& data) {
  CalibrationData cameras = data;
  std::erase_if(cameras.sensors, [](const SensorSpec& sensor) { return sensor.kind != SensorKind::camera; });
  cameras.observations.stripes.clear();
  cameras.observations.features.clear();
  cameras.pairs.clear();
  return cameras;
}

void thin(StripeView& view) {
  const std::size_t step = (view.coordinates_px.size() + kReadingsPerView - 1) / kReadingsPerView;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < view.coordinates_px.size(); i += step, ++kept) {
    view.camera_pixels[kept] = view.camera_pixels[i];
    view.coordinates_px[kept] = view.coordinates_px[i];
  }
  view.camera_pixels.resize(kept);
  view.coordinates_px.resize(kept);
}

// Placements by fold: every fifth one.
std::vector<std::set<std::size_t>> folds_of(std::size_t placements) {
  std::vector<std::set<std::size_t>> folds(std::min(kFolds, placements));
  for (std::size_t p = 0; p < placements; ++p) folds[p % folds.size()].insert(p);
  return folds;
}

CalibrationData without_fold(CalibrationData data, const std::set<std::size_t>& fold) {
  for (auto p = fold.rbegin(); p != fold.rend(); ++p) data = without_placement(data, *p);
  return data;
}

// The corners of one placement that are no outliers.
std::vector<CornerView> good_corners(const CalibrationData& data, const BundleResult& judge, std::size_t placement) {
  std::vector<CornerView> views;
  for (std::size_t v = 0; v < data.observations.corners.size(); ++v) {
    const CornerView& view = data.observations.corners[v];
    if (view.placement != placement) continue;
    CornerView good{view.sensor, placement, {}, {}};
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (!judge.views[v].inlier[i]) continue;
      good.corners.push_back(view.corners[i]);
      good.pixels.push_back(view.pixels[i]);
    }
    views.push_back(std::move(good));
  }
  return views;
}

void add_squares(const View& view, const Eigen::VectorXd& residuals, const std::vector<char>& inlier,
                 Squares& squares) {
  const int d = view.dimension();
  for (int i = 0; i < view.size(); ++i) {
    if (!inlier[static_cast<std::size_t>(i)]) continue;
    squares.sum += residuals.segment(d * i, d).squaredNorm();
    ++squares.count;
  }
}

// Predicts the placements of a fold with the rig that has not seen them. The reason where one cannot be.
Expected<void> predict(const CalibrationData& data, SensorKind kind, const std::set<std::size_t>& fold,
                       const BundleResult& judge, const Calibration& blind, Trial& trial) {
  const CalibrationState& full = trial.calibration->bundle.state;
  CalibrationState state = full;
  state.rig = blind.bundle.state.rig;
  state.boards = blind.bundle.state.boards;
  for (const std::size_t p : fold) {
    const auto pose =
        fit_board_pose(state.rig, state.board_at(p), good_corners(data, judge, p), full.world_from_board[p]);
    if (!pose) return fail(fmt::format("{}: {}", data.placement_names[p], pose.error().message));
    state.world_from_board[p] = *pose;
  }
  const auto views = make_views(data.observations, data.board_of);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto placement = views[v]->placement();
    if (!judged_by(*views[v], kind) || !placement || !fold.contains(*placement)) continue;
    ViewEvaluation evaluation;
    if (!views[v]->evaluate(state, false, evaluation)) {
      return fail(
          fmt::format("{}: the {} cannot be predicted", data.placement_names[*placement], name_of(views[v]->kind())));
    }
    add_squares(*views[v], evaluation.residuals, judge.views[v].inlier, trial.held_out[*placement]);
  }
  return {};
}

Trial fit(const CalibrationData& data, const std::string& model, const CalibrationOptions& options,
          const std::function<void()>& report) {
  Trial trial;
  trial.candidate.model = model;
  const auto keep = [&](const Expected<Calibration>& calibration) {
    report();
    if (!calibration) trial.candidate.reason = "could not be fitted: " + calibration.error().message;
    return calibration.has_value();
  };
  auto calibration = calibrate(data, options);
  if (!keep(calibration)) return trial;
  trial.calibration = std::move(*calibration);
  for (const auto& fold : folds_of(data.placement_names.size())) {
    auto blind = calibrate(without_fold(data, fold), options);
    if (!keep(blind)) return trial;
    trial.folds.push_back(std::move(*blind));
  }
  trial.candidate.fitted = true;
  return trial;
}

// The fit's and the held-out residuals, the outliers of `judge` left out.
void score(const CalibrationData& data, SensorKind kind, const BundleResult& judge, Trial& trial) {
  const auto folds = folds_of(data.placement_names.size());
  for (std::size_t f = 0; f < folds.size(); ++f) {
    if (const auto done = predict(data, kind, folds[f], judge, trial.folds[f], trial); !done) {
      trial.candidate.fitted = false;
      trial.candidate.reason = "cannot predict held-out placements: " + done.error().message;
      return;
    }
  }
  Squares fitted, held_out;
  const auto views = make_views(data.observations, data.board_of);
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!judged_by(*views[v], kind)) continue;
    add_squares(*views[v], trial.calibration->bundle.views[v].residuals_px, judge.views[v].inlier, fitted);
  }
  for (const auto& [placement, squares] : trial.held_out) {
    held_out.sum += squares.sum;
    held_out.count += squares.count;
  }
  const auto rms = [](const Squares& s) {
    return std::sqrt(s.sum / static_cast<double>(std::max<std::size_t>(s.count, 1)));
  };
  trial.candidate.rms_px = rms(fitted);
  trial.candidate.held_out_rms_px = rms(held_out);
  for (const Undetermined& undetermined : trial.calibration->bundle.undetermined) {
    trial.candidate.undetermined.insert(trial.candidate.undetermined.end(), undetermined.terms.begin(),
                                        undetermined.terms.end());
  }
}

// Wald statistic of the terms beyond the first `common` of every lens of the kind, and its degrees of freedom.
std::pair<double, int> wald(const Calibration& calibration, SensorKind kind, int common) {
  const CalibrationState& state = calibration.bundle.state;
  std::vector<BlockId> blocks;
  std::vector<Eigen::Index> rows;
  std::vector<double> values;
  Eigen::Index offset = 0;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    const Sensor& sensor = state.rig.sensors[s];
    if (sensor.kind != kind) continue;
    blocks.push_back({BlockId::Kind::lens, s});
    for (int i = common; i < sensor.lens.parameter_count(); ++i) {
      rows.push_back(offset + i);
      values.push_back(sensor.lens.parameters()[static_cast<std::size_t>(i)]);
    }
    offset += sensor.lens.parameter_count();
  }
  const Eigen::MatrixXd joint = calibration.bundle.covariance.of(blocks, state);
  const Eigen::MatrixXd covariance = joint(rows, rows);
  const Eigen::Map<const Eigen::VectorXd> terms(values.data(), static_cast<Eigen::Index>(values.size()));
  // Equilibrated: the terms differ by orders of magnitude.
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd scaled = scale.cwiseProduct(terms);
  const SymmetricEigen correlation = symmetric_eigen(scale.asDiagonal() * covariance * scale.asDiagonal());
  const Eigen::VectorXd along = correlation.vectors.transpose() * scaled;
  return {along.cwiseAbs2().cwiseQuotient(correlation.values).sum(), static_cast<int>(values.size())};
}

// Mean over the placements of the fall of their mean square residual, and its standard error.
std::pair<double, double> gain(const Trial& from, const Trial& to) {
  std::vector<double> gains;
  for (const auto& [placement, before] : from.held_out) {
    const Squares& after = to.held_out.at(placement);
    if (before.count > 0) gains.push_back((before.sum - after.sum) / static_cast<double>(before.count));
  }
  const auto count = static_cast<double>(gains.size());
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / count;
  double squares = 0;
  for (const double g : gains) squares += (g - mean) * (g - mean);
  return {mean, std::sqrt(squares / (count - 1) / count)};
}

void compare(const Trial& best, SensorKind kind, Trial& trial) {
  LensCandidate& c = trial.candidate;
  c.against = best.candidate.model;
  const int common = static_cast<int>(lens_parameter_names(best.candidate.model).size());
  int degrees = 0;
  std::tie(c.statistic, degrees) = wald(*trial.calibration, kind, common);
  c.statistic_limit = chi_square_limit(degrees);
  std::tie(c.gain_px2, c.gain_sigma_px2) = gain(best, trial);
  std::vector<std::string> against;
  if (!(c.statistic > c.statistic_limit)) against.emplace_back("its further terms are not significant");
  if (!(c.gain_px2 > c.gain_sigma_px2)) against.emplace_back("it does not foretell unseen placements better");
  c.taken = against.empty();
  c.reason =
      c.taken ? "significant, and foretells unseen placements better" : fmt::format("{}", fmt::join(against, "; "));
  if (!c.undetermined.empty()) {
    c.reason += fmt::format("; the data do not determine {}", fmt::join(c.undetermined, ", "));
  }
}

Expected<LensChoice> choose(const CalibrationData& data, SensorKind kind, const CalibrationOptions& options,
                            const std::function<void()>& report) {
  std::vector<Trial> trials;
  const Trial* richest = nullptr;
  for (const char* model : kLadder) {
    trials.push_back(fit(with_model(data, kind, {}, model), model, options, report));
  }
  for (const Trial& trial : trials) {
    if (trial.candidate.fitted) richest = &trial;
  }
  if (richest == nullptr) return fail(fmt::format("no lens model fits: {}", trials.front().candidate.reason));
  const BundleResult judge = richest->calibration->bundle;
  LensChoice choice{kind, {}, {}, {}};
  const Trial* best = nullptr;
  for (Trial& trial : trials) {
    if (trial.candidate.fitted) score(data, kind, judge, trial);
    if (trial.candidate.fitted && best == nullptr) {
      trial.candidate.taken = true;
      trial.candidate.reason = "the first that fits";
    } else if (trial.candidate.fitted) {
      compare(*best, kind, trial);
    }
    if (trial.candidate.taken) best = &trial;
    choice.candidates.push_back(trial.candidate);
  }
  if (best == nullptr) return fail(fmt::format("no lens model fits: {}", trials.front().candidate.reason));
  choice.model = best->candidate.model;
  return choice;
}

bool has(const CalibrationData& data, SensorKind kind) {
  return std::any_of(data.sensors.begin(), data.sensors.end(),
                     [&](const SensorSpec& sensor) { return sensor.kind == kind; });
}

using Choices = std::vector<LensChoice>;

Expected<void> check_placements(const CalibrationData& data) {
  if (data.placement_names.size() >= kFewestPlacements) return {};
  return fail(
      fmt::format("choosing a lens model by held-out views wants {} board placements, not {}: name the model "
                  "instead",
                  kFewestPlacements, data.placement_names.size()));
}

// Of sensors that stand still.
Expected<Choices> choose_still(const CalibrationData& data, const CalibrationOptions& options,
                               const std::function<void()>& report) {
  if (const auto enough = check_placements(data); !enough) return tl::unexpected(enough.error());
  Choices choices;
  auto cameras = choose(cameras_alone(data), SensorKind::camera, options, report);
  if (!cameras) return tl::unexpected(cameras.error());
  choices.push_back(std::move(*cameras));
  if (!has(data, SensorKind::projector)) return choices;
  CalibrationData thinned = with_lenses(data, choices);
  for (StripeView& view : thinned.observations.stripes) thin(view);
  auto projectors = choose(thinned, SensorKind::projector, options, report);
  if (!projectors) return tl::unexpected(projectors.error());
  choices.push_back(std::move(*projectors));
  return choices;
}

std::size_t steps_of_still(const CalibrationData& data) {
  const std::size_t kinds = has(data, SensorKind::projector) ? 2 : 1;
  return kinds * kLadder.size() * (1 + folds_of(data.placement_names.size()).size());
}

struct MountedPart {
  Mount mount;
  CalibrationData data;
};

std::vector<MountedPart> parts_of(const CalibrationData& data) {
  std::vector<MountedPart> parts;
  for (const Mount mount : {Mount::probe, Mount::world}) {
    SystemPart part = system_part(data, mount);
    if (!part.sensors.empty()) parts.push_back({mount, std::move(part.data)});
  }
  return parts;
}

}  // namespace

Expected<Choices> choose_lenses(const CalibrationData& data, const CalibrationOptions& options,
                                const std::function<void()>& report) {
  if (data.station_names.empty()) return choose_still(data, options, report);
  const std::vector<MountedPart> parts = parts_of(data);
  const auto of_part = [](const MountedPart& part, const Error& error) {
    return fail(
        fmt::format("{}: {}", part.mount == Mount::probe ? "the probe's sensors" : "the trackers", error.message));
  };
  for (const MountedPart& part : parts) {
    if (const auto enough = check_placements(part.data); !enough) return of_part(part, enough.error());
  }
  Choices all;
  for (const MountedPart& part : parts) {
    auto choices = choose_still(part.data, options, report);
    if (!choices) return of_part(part, choices.error());
    for (LensChoice& choice : *choices) {
      choice.mount = part.mount;
      all.push_back(std::move(choice));
    }
  }
  return all;
}

std::size_t lens_choice_steps(const CalibrationData& data) {
  if (data.station_names.empty()) return steps_of_still(data);
  std::size_t steps = 0;
  for (const MountedPart& part : parts_of(data)) steps += steps_of_still(part.data);
  return steps;
}

CalibrationData with_lenses(CalibrationData data, const std::vector<LensChoice>& choices) {
  for (const LensChoice& choice : choices) data = with_model(std::move(data), choice.kind, choice.mount, choice.model);
  return data;
}

}  // namespace crumple
