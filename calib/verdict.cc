#include "calib/verdict.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/alternatives.h"
#include "calib/moved_sensor.h"
#include "calib/regional_tests.h"
#include "calib/rig_prior.h"
#include "calib/scale_uncertainty.h"
#include "calib/unseen_parts.h"
#include "calib/volume_coverage.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

constexpr double kBadViewRatio = 2.5;
constexpr double kBadViewOutliers = 0.25;
constexpr double kGrossViewRatio = 4;
constexpr int kGrossViewOutliers = 3;
constexpr double kGroupOutliers = 0.05;
constexpr std::size_t kFewPlacements = 5;
constexpr double kSmallTilt_rad = 20 * std::numbers::pi / 180;
constexpr double kFocalUncertainty = 0.01;
constexpr double kFocalUnknown = 0.1;
constexpr double kBadViewShare = 0.25;  // of all views, from which on the calibration is rejected
constexpr double kIllConditioned = 1e9;
constexpr double kContradiction = 1e-4;  // probability
constexpr double kBentByChance = 1e-3;   // probability
constexpr double kNoisier = 3;
constexpr double kUnknownThere_px = 1;  // projection uncertainty of a part of the image that was never looked at
constexpr double kFinePitch = 5e-4;     // good boards are made to that; what would not show beyond it is said
constexpr double kWorseThere = 3;       // than where it was
constexpr double kVolumeCovered = 0.5;
// Printers and the moisture of paper change a pitch by a few tenths of a per cent; one that was typed wrong, or printed
// to fit the page, is as a rule off by one per cent or more.
constexpr double kPrintedPitch = 5e-3;
constexpr double kPitchSigmas = 4;  // beyond which a measured pitch is not the stated one: by chance once in 16,000
constexpr double kFourOfFive = 0.8;

const GroupSummary& group_of(const BundleResult& bundle, const ViewSummary& view) {
  return *std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& group) {
    return group.sensor == view.sensor && group.kind == view.kind;
  });
}

// Two significant digits, or all before the point.
std::string two_digits(double value) {
  return value >= 10 ? fmt::format("{:.0f}", value) : fmt::format("{:.2g}", value);
}

// Where the view was taken: of a probe that is moved about both what it saw and from where.
std::string where(const Calibration& calibration, const ViewSummary& view) {
  const std::string place = place_name(calibration, view);
  if (!view.placement || !view.station) return fmt::format("station {}", place);
  return fmt::format("station {} (placement {})", calibration.station_names[*view.station], place);
}

// Whether the corners of the same place and station are as good as usual.
bool corners_are_good(const Calibration& calibration, const ViewSummary& of_stripes) {
  const auto& views = calibration.bundle.views;
  return std::any_of(views.begin(), views.end(), [&](const ViewSummary& view) {
    if (view.kind != View::Kind::corners || view.placement != of_stripes.placement ||
        view.station != of_stripes.station || view.inlier.empty()) {
      return false;
    }
    const auto left_out = std::count(view.inlier.begin(), view.inlier.end(), 0);
    return static_cast<double>(left_out) <= kBadViewOutliers * static_cast<double>(view.inlier.size());
  });
}

void judge_views(const Calibration& calibration, Verdict& verdict) {
  std::size_t bad = 0;
  for (const ViewSummary& view : calibration.bundle.views) {
    if (view.inlier.empty()) continue;
    const GroupSummary& group = group_of(calibration.bundle, view);
    const double per_axis = View::dimension_of(view.kind) == 1 ? 1 : std::numbers::sqrt2;
    const double expected = group.sigma_px * per_axis;
    const auto left_out = std::count(view.inlier.begin(), view.inlier.end(), 0);
    const double share = static_cast<double>(left_out) / static_cast<double>(view.inlier.size());
    // Stripes may hold gross decoding errors that the gate takes care of; corners that far off mean a wrong detection.
    // One or two that were misread are the outlier rule's to take care of.
    const bool gross = View::dimension_of(view.kind) == 2 && left_out >= kGrossViewOutliers &&
                       view.rms_all_px > kGrossViewRatio * expected;
    if (view.rms_all_px <= per_axis * kExactEnough_px) continue;
    if (view.rms_px <= kBadViewRatio * expected && share <= kBadViewOutliers && !gross) continue;
    ++bad;
    const bool out_of_step =
        view.kind == View::Kind::stripes && share > kBadViewOutliers && corners_are_good(calibration, view);
    verdict.reasons.push_back(fmt::format(
        "{} is bad in {}: RMS {} px where {} px is usual, {:.0f} % of its {} left out; {}", where(calibration, view),
        calibration.bundle.state.rig.sensors[view.sensor].name, two_digits(view.rms_all_px), two_digits(expected),
        100 * share, name_of(view.kind),
        out_of_step ? "its corners are good: camera and projector were out of step, or something moved between the "
                      "patterns; take it again"
                    : "look at the image, or exclude it with the reason"));
  }
  const auto all = static_cast<double>(calibration.bundle.views.size());
  if (static_cast<double>(bad) > kBadViewShare * all) verdict.rejected = true;
}

void judge_groups(const BundleResult& bundle, std::vector<std::string>& reasons) {
  if (!bundle.settled) {
    reasons.push_back(
        fmt::format("outliers and noise did not settle within {} rounds: the model does not describe these "
                    "observations",
                    bundle.rounds));
  }
  for (const GroupSummary& group : bundle.groups) {
    const std::string name = group_name(bundle.state.rig, group.sensor, group.kind);
    const double share = static_cast<double>(group.outliers) / static_cast<double>(group.observations);
    const double per_axis = View::dimension_of(group.kind) == 1 ? 1 : std::numbers::sqrt2;
    if (share > kGroupOutliers && group.rms_all_px > per_axis * kExactEnough_px) {
      reasons.push_back(fmt::format("{}: {:.1f} % of the observations are outliers", name, 100 * share));
    }
    if (!group.sigma_estimated) {
      reasons.push_back(
          fmt::format("{}: too few observations to estimate their noise; {:.2f} px is assumed", name, group.sigma_px));
    }
  }
}

// The boards that the sensors on one mount saw, in its frame: each placement from each station once.
std::vector<Pose> boards_before(Mount mount, const BundleResult& bundle) {
  const CalibrationState& state = bundle.state;
  std::set<std::pair<std::size_t, std::optional<std::size_t>>> seen;
  for (const ViewSummary& view : bundle.views) {
    if (view.placement && state.rig.sensors[view.sensor].mount == mount) seen.insert({*view.placement, view.station});
  }
  std::vector<Pose> boards;
  for (const auto& [placement, station] : seen) {
    const Pose& world_from_board = state.world_from_board[placement];
    boards.push_back(station ? state.world_from_probe[*station].inverse() * world_from_board : world_from_board);
  }
  return boards;
}

// The largest angle between two board normals.
double tilt_span_rad(const std::vector<Pose>& boards) {
  double smallest_cosine = 1;
  for (const Pose& a : boards) {
    for (const Pose& b : boards) {
      const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
      smallest_cosine = std::min(smallest_cosine, (a.rotation * z).dot(b.rotation * z));
    }
  }
  return std::acos(std::clamp(smallest_cosine, -1.0, 1.0));
}

void judge_boards(Mount mount, const BundleResult& bundle, std::vector<std::string>& reasons) {
  const auto& sensors = bundle.state.rig.sensors;
  if (std::none_of(sensors.begin(), sensors.end(), [&](const Sensor& s) { return s.mount == mount; })) return;
  const std::vector<Pose> boards = boards_before(mount, bundle);
  const char* const before = mount == Mount::world ? " before the trackers" : "";
  if (boards.size() < kFewPlacements) {
    reasons.push_back(fmt::format("only {} board placements{}: take at least {}, tilted differently", boards.size(),
                                  before, kFewPlacements));
  }
  if (const double span = tilt_span_rad(boards); span < kSmallTilt_rad) {
    reasons.push_back(fmt::format("the board's tilts{} span only {:.0f} degrees: tilt it by 30 degrees about both axes",
                                  before, span * 180 / std::numbers::pi));
  }
}

void judge_geometry(const Calibration& calibration, Verdict& verdict) {
  std::vector<std::string>& reasons = verdict.reasons;
  const CalibrationState& state = calibration.bundle.state;
  // An earlier rig had boards enough.
  if (!calibration.earlier) {
    judge_boards(Mount::probe, calibration.bundle, reasons);
    judge_boards(Mount::world, calibration.bundle, reasons);
  }
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    const Sensor& sensor = state.rig.sensors[s];
    const Eigen::MatrixXd covariance = whole_covariance(calibration).of({{BlockId::Kind::lens, s}}, state);
    const double relative = std::sqrt(covariance(0, 0)) / sensor.lens.parameters()[0];
    if (relative > kFocalUnknown) verdict.rejected = true;
    if (relative > kFocalUncertainty) {
      reasons.push_back(fmt::format("{}: the focal length is known to {:.1f} % only: add tilts and distances",
                                    sensor.name, 100 * relative));
    }
  }
  const std::string weakest = calibration.bundle.covariance.weakest_direction();
  // What a weak prior holds is noted as such.
  const auto& held = calibration.bundle.undetermined;
  const bool held_by_prior = std::any_of(held.begin(), held.end(), [&](const Undetermined& direction) {
    return std::any_of(direction.terms.begin(), direction.terms.end(),
                       [&](const std::string& term) { return weakest.find(term) != std::string::npos; });
  });
  if (calibration.bundle.covariance.condition() > kIllConditioned && !held_by_prior) {
    reasons.push_back(
        fmt::format("{} can hardly be told apart: choose a lens model with fewer terms or add views", weakest));
  }
}

void note_unseen_sensors(const BundleResult& bundle, std::vector<std::string>& notes) {
  std::vector<std::string> unseen;
  for (std::size_t s = 0; s < bundle.state.rig.sensors.size(); ++s) {
    const bool seen = std::any_of(bundle.groups.begin(), bundle.groups.end(),
                                  [&](const GroupSummary& group) { return group.sensor == s; });
    if (!seen) unseen.push_back(bundle.state.rig.sensors[s].name);
  }
  if (unseen.empty()) return;
  notes.push_back(fmt::format("nothing was observed by {}: the earlier rig's word stands", fmt::join(unseen, ", ")));
}

// Whether an earlier rig, which the refinement went on from, is one that these observations could come from.
void judge_earlier(const Calibration& calibration, std::vector<std::string>& reasons) {
  const BundleResult& bundle = calibration.bundle;
  for (const Prior& prior : calibration.priors) {
    if (prior.name() != kRigPrior) continue;
    const WhitenedPrior whitened = prior.evaluate(bundle.state);
    Eigen::MatrixXd jacobian(whitened.residuals.size(), 0);
    for (const RowMajorMatrix& block : whitened.jacobians) {
      jacobian.conservativeResize(Eigen::NoChange, jacobian.cols() + block.cols());
      jacobian.rightCols(block.cols()) = block;
    }
    // What the observations say of its directions: the prior's variance less what is left of it. What is held cannot
    // contradict them.
    const Eigen::MatrixXd covariance = bundle.covariance.of(prior.blocks(), bundle.state);
    const auto free = static_cast<double>((covariance.diagonal().array() > 0).count());
    const double degrees = free - (jacobian * covariance).cwiseProduct(jacobian).sum();
    const double square = whitened.residuals.squaredNorm();
    if (chi_square_tail(square, std::max(1, static_cast<int>(std::ceil(degrees)))) >= kContradiction) continue;
    reasons.push_back(fmt::format(
        "the earlier rig contradicts these observations (chi-square {:.0f} where {:.0f} is usual): see what "
        "changed with `check --rig`, or calibrate without it",
        square, degrees));
  }
  for (const GroupSummary& group : bundle.groups) {
    const std::string name = group_name(bundle.state.rig, group.sensor, group.kind);
    const auto& sigmas = calibration.earlier->rig.sigma_px;
    const auto usual = sigmas.find(name);
    if (usual == sigmas.end() || !group.sigma_estimated || group.sigma_px < kNoisier * usual->second) continue;
    reasons.push_back(
        fmt::format("{} scatter by {} px where {} px is usual of the earlier rig: is this another probe or tracker?",
                    name, two_digits(group.sigma_px), two_digits(usual->second)));
  }
}

// "the left", "the left and the bottom", "the left, the middle and the bottom".
std::string listed(const std::vector<std::string>& parts) {
  std::string text = "the " + parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) text += (i + 1 == parts.size() ? " and the " : ", the ") + parts[i];
  return text;
}

// Boards whose bending was allowed for, where it is beyond chance.
void note_bent_boards(const BundleResult& bundle, std::vector<std::string>& notes) {
  for (std::size_t b = 0; b < bundle.state.boards.size(); ++b) {
    const Eigen::MatrixXd covariance = bundle.covariance.of({{BlockId::Kind::warp, b}}, bundle.state);
    if (!(covariance(0, 0) > 0)) continue;
    const Eigen::Vector2d warp_mm = bundle.state.boards[b].warp_mm;
    const double square = warp_mm.dot(Eigen::Vector2d(solve_symmetric(covariance, warp_mm)));
    if (chi_square_tail(square, 2) > kBentByChance) continue;
    const auto [low, high] = std::minmax({0.0, warp_mm.x(), warp_mm.y(), warp_mm.sum()});
    notes.push_back(
        fmt::format("board '{}' is bent by {:.2g} mm, which was allowed for", bundle.state.boards[b].name, high - low));
  }
}

// What the parts of one sensor's image that no view covers are known to.
std::string uncovered(const Sensor& sensor, const std::vector<UnseenPart>& parts) {
  std::vector<std::string> names;
  double worst_px = 0;
  for (const UnseenPart& part : parts) {
    names.push_back(part.name);
    worst_px = std::max(worst_px, part.sigma_px);
  }
  return fmt::format(
      "no view covers {} of {}: what is seen there is known to {:.2g} px, elsewhere to {:.2g} px; {}", listed(names),
      sensor.name, worst_px, parts.front().seen_sigma_px,
      sensor.mount == Mount::world ? "take the board or the probe there" : "put or tilt the board there");
}

void judge_images(const Observations& observations, const Calibration& calibration, Verdict& verdict) {
  const BundleResult& bundle = calibration.bundle;
  const auto& sensors = bundle.state.rig.sensors;
  const auto residuals = placed_residuals(observations, bundle);
  std::vector<ImageCells> cells;
  for (std::size_t s = 0; s < sensors.size(); ++s) cells.push_back(image_cells(residuals[s], sensors[s].lens.size()));
  const auto unseen = unseen_parts(bundle.state.rig, cells, sensor_uncertainties(calibration, cells));
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    std::vector<UnseenPart> unknown, worse;
    for (const UnseenPart& part : unseen) {
      if (part.sensor != s) continue;
      // Trackers look at where the probe works, and at much else.
      const bool needed = sensors[s].mount == Mount::probe;
      if (needed && part.sigma_px > kUnknownThere_px) {
        unknown.push_back(part);
      } else if (part.sigma_px > kWorseThere * part.seen_sigma_px) {
        worse.push_back(part);
      }
    }
    if (!unknown.empty()) verdict.reasons.push_back(uncovered(sensors[s], unknown));
    if (!worse.empty()) verdict.notes.push_back(uncovered(sensors[s], worse));
  }
  for (const RegionalTest& test : regional_tests(residuals, bundle.groups, bundle.state.rig, calibration.inflation)) {
    if (!test.pattern()) continue;
    verdict.notes.push_back(fmt::format(
        "the residuals of {} form a pattern over its image, most of all {}, where their mean is ({:+.2g}, {:+.2g}) px: "
        "chi-square of the means {:.0f} where {} is usual; a board that is not flat does that, or a lens model that is "
        "not enough (--lens=auto)",
        group_name(bundle.state.rig, test.sensor, test.kind), test.worst_part, test.worst_mean_px.x(),
        test.worst_mean_px.y(), test.chi_square, test.degrees_of_freedom));
  }
}

void note_volume(const Observations& observations, const BundleResult& bundle, std::vector<std::string>& notes) {
  const auto coverage = volume_coverage(observations, bundle.state, bundle.views);
  if (!coverage) return;
  const std::string& camera = bundle.state.rig.sensors[coverage->camera].name;
  if (coverage->shallow()) {
    notes.push_back(
        fmt::format("all boards before {} stood between {:.0f} and {:.0f} mm: nearer and farther everything is "
                    "extrapolated; show boards at the distances that are measured at",
                    camera, coverage->near_mm, coverage->far_mm));
  }
  const auto parts = static_cast<int>(coverage->corners.size());
  if (coverage->covered() < kVolumeCovered * parts) {
    notes.push_back(
        fmt::format("boards stood in {} of {} parts of the volume before {} ({:.0f} to {:.0f} mm deep): show them near "
                    "and far in every part of its image",
                    coverage->covered(), parts, camera, coverage->near_mm, coverage->far_mm));
  }
}

// An unknown scale is no fault of the calibration, but every length hangs on it.
void note_scale(const Calibration& calibration, std::vector<std::string>& notes) {
  if (!calibration.scale) {
    notes.push_back(
        "the scale's uncertainty is unknown, and no length's uncertainty contains it: state a board's certificate, or "
        "show a scale bar");
  } else if (!calibration.scale->lacks.empty()) {
    notes.push_back(
        fmt::format("the scale's uncertainty is not complete: {}", fmt::join(calibration.scale->lacks, "; ")));
  }
}

void note_untied_boards(const CalibrationData& data, const Calibration& calibration, std::vector<std::string>& notes) {
  std::vector<std::string> names;
  for (const MeasuredScale& size : measured_scales(data, calibration.bundle, whole_covariance(calibration))) {
    if (!size.determined) names.push_back(fmt::format("'{}'", calibration.bundle.state.boards[size.board].name));
  }
  if (names.empty()) return;
  notes.push_back(
      fmt::format("the observations do not tie the size of board {} to bars or certified boards: only a weak prior "
                  "holds it; show it to sensors that see one of these too and are fixed to each other, or state its "
                  "certificate",
                  fmt::join(names, ", ")));
}

std::vector<std::string> notes_on(const Calibration& calibration) {
  constexpr std::size_t kNamed = 6;
  const BundleResult& bundle = calibration.bundle;
  std::vector<std::string> notes;
  note_bent_boards(bundle, notes);
  for (const Undetermined& undetermined : bundle.undetermined) {
    if (undetermined.prior == kWeakScale) continue;
    const std::size_t named = std::min(kNamed, undetermined.terms.size());
    const std::vector<std::string> terms(undetermined.terms.begin(),
                                         undetermined.terms.begin() + static_cast<std::ptrdiff_t>(named));
    const std::size_t more = undetermined.terms.size() - named;
    notes.push_back(fmt::format(
        "the observations do not determine {}{}{}: only a weak prior holds them; a lens model with fewer terms does "
        "without",
        fmt::join(terms, ", "), more > 0 ? fmt::format(" and {} more", more) : "",
        undetermined.partners.empty()
            ? ""
            : fmt::format(", which trade places with {}", fmt::join(undetermined.partners, ", "))));
  }
  return notes;
}

// A pitch beside bars or certified boards is measured, and a wrong one leaves no trace in the residuals. What a printer
// may have made of it is a note.
void judge_pitches(const CalibrationData& data, const Calibration& calibration, std::vector<std::string>& faults,
                   std::vector<std::string>& notes) {
  for (const MeasuredScale& size : measured_scales(data, calibration.bundle, whole_covariance(calibration))) {
    if (!size.determined) continue;
    const BoardSpec& board = data.boards[size.board];
    const double off = size.scale - 1;
    if (std::abs(off) <= kPitchSigmas * size.sigma) {
      const double detectable = size.sigma * std::sqrt(noncentrality_seen(kPitchSigmas * kPitchSigmas, 1, kFourOfFive));
      if (detectable < kPrintedPitch) continue;
      notes.push_back(
          fmt::format("a wrong pitch would show from {:.2g} % on of board '{}'", 100 * detectable, board.name));
    } else if (std::abs(off) >= kFinePitch) {
      const double stated_mm = board.target.pitch_mm, u_mm = size.sigma * stated_mm;
      const int decimals = std::max(0, 1 - static_cast<int>(std::floor(std::log10(std::max(u_mm, 1e-9)))));
      const bool mistaken = std::abs(off) >= kPrintedPitch;
      (mistaken ? faults : notes)
          .push_back(
              fmt::format("the pitch of board '{}' is off by {:+.3g} %: {:.6g} mm is stated, and measured by "
                          "{} it is {:.{}f} mm (u = {:.2g} mm); {}",
                          board.name, 100 * off, stated_mm,
                          calibration.earlier ? "bars, certificates or the earlier rig" : "bars and certificates",
                          size.scale * stated_mm, decimals, u_mm,
                          mistaken ? "correct it, or the length that is wrong of a bar or certificate"
                                   : "a printer may do that, and what was measured counts"));
    }
  }
}

// What the search for a wrong pitch could not see.
void note_size_limits(const AlternativeTests& tests, Verdict& verdict) {
  if (!tests.untestable_sizes.empty()) {
    verdict.notes.push_back(fmt::format("nothing here could contradict the size of {}: a wrong pitch would not show",
                                        fmt::join(tests.untestable_sizes, ", ")));
  }
  std::vector<std::string> limits;
  for (const SizeLimit& limit : tests.size_limits) {
    if (limit.detectable < kFinePitch) continue;
    limits.push_back(fmt::format("from {:.2g} % on of {}", 100 * limit.detectable, limit.subject));
  }
  const bool found = std::any_of(tests.found.begin(), tests.found.end(),
                                 [](const Alternative& a) { return a.kind == AlternativeKind::size; });
  if (!limits.empty() && !found) {
    verdict.notes.push_back(fmt::format("a wrong pitch would show {}", fmt::join(limits, ", ")));
  }
}

// The model question: where no richer lens is a reason, which ones were tried.
void note_lenses(const AlternativeTests& tests, Verdict& verdict) {
  std::vector<std::string> enough;
  for (const std::string& lens : tests.tested_lenses) {
    const bool found = std::any_of(tests.found.begin(), tests.found.end(), [&](const Alternative& a) {
      return a.kind == AlternativeKind::lens && a.subject == lens;
    });
    const auto& further = tests.further_lenses;
    if (!found && std::find(further.begin(), further.end(), lens) == further.end()) enough.push_back(lens);
  }
  if (!tests.further_lenses.empty()) {
    verdict.notes.push_back(
        fmt::format("a richer model would describe {} better as well", fmt::join(tests.further_lenses, ", ")));
  }
  if (enough.empty()) return;
  verdict.notes.push_back(
      fmt::format("a richer model would not describe {} better by anything that matters (tried: a spline's terms, and "
                  "OPENCV8's where they are lacking)",
                  fmt::join(enough, ", ")));
}

}  // namespace

std::string level_of(const Verdict& verdict) {
  if (verdict.ok) return "ok";
  return verdict.rejected ? "rejected" : "suspect";
}

Verdict judge(const Calibration& calibration) {
  Verdict verdict;
  judge_views(calibration, verdict);
  judge_groups(calibration.bundle, verdict.reasons);
  judge_geometry(calibration, verdict);
  if (calibration.earlier) judge_earlier(calibration, verdict.reasons);
  verdict.notes = notes_on(calibration);
  if (calibration.earlier) note_unseen_sensors(calibration.bundle, verdict.notes);
  verdict.ok = verdict.reasons.empty();
  return verdict;
}

Verdict judge(const CalibrationData& data, const Calibration& calibration, int threads) {
  Verdict verdict = judge(calibration);
  std::vector<std::string> faults;
  const auto alternatives = test_alternatives(data, calibration, threads);
  // Linearised where the model is wrong, that may name another sensor than the one that was moved.
  const bool elsewhere =
      alternatives && std::any_of(alternatives->found.begin(), alternatives->found.end(),
                                  [](const Alternative& a) { return a.kind == AlternativeKind::place; });
  const auto moved = verdict.ok && !elsewhere ? std::nullopt : find_moved_sensor(data, calibration, threads);
  if (moved) faults.push_back(moved->sentence);
  judge_pitches(data, calibration, faults, verdict.notes);
  if (!alternatives) {
    verdict.notes.push_back("faults were not looked for: " + alternatives.error().message);
  } else {
    for (const Alternative& found : alternatives->found) {
      if (!moved || found.kind != AlternativeKind::place) faults.push_back(found.sentence);
    }
    note_size_limits(*alternatives, verdict);
    note_lenses(*alternatives, verdict);
  }
  verdict.reasons.insert(verdict.reasons.begin(), faults.begin(), faults.end());
  judge_images(data.observations, calibration, verdict);
  // An earlier rig saw boards of its own.
  if (!calibration.earlier) note_volume(data.observations, calibration.bundle, verdict.notes);
  note_scale(calibration, verdict.notes);
  note_untied_boards(data, calibration, verdict.notes);
  verdict.ok = verdict.reasons.empty();
  return verdict;
}

}  // namespace crumple
