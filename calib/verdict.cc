#include "calib/verdict.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/rig_prior.h"
#include "solvers/chi_square.h"

namespace crumple {
namespace {

constexpr double kBadViewRatio = 2.5;
constexpr double kBadViewOutliers = 0.25;
constexpr double kGrossViewRatio = 4;
constexpr double kGroupOutliers = 0.05;
constexpr std::size_t kFewPlacements = 5;
constexpr double kSmallTilt_rad = 20 * std::numbers::pi / 180;
constexpr double kFocalUncertainty = 0.01;
constexpr double kIllConditioned = 1e9;
constexpr double kContradiction = 1e-4;  // probability
constexpr double kNoisier = 3;

const GroupSummary& group_of(const BundleResult& bundle, const ViewSummary& view) {
  return *std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& group) {
    return group.sensor == view.sensor && group.kind == view.kind;
  });
}

void judge_views(const Calibration& calibration, std::vector<std::string>& reasons) {
  for (const ViewSummary& view : calibration.bundle.views) {
    if (view.inlier.empty()) continue;
    const GroupSummary& group = group_of(calibration.bundle, view);
    const double expected = group.sigma_px * (View::dimension_of(view.kind) == 1 ? 1 : std::numbers::sqrt2);
    const auto left_out = std::count(view.inlier.begin(), view.inlier.end(), 0);
    const double share = static_cast<double>(left_out) / static_cast<double>(view.inlier.size());
    // Stripes may hold gross decoding errors that the gate takes care of; corners that far off mean a wrong detection.
    const bool gross = View::dimension_of(view.kind) == 2 && view.rms_all_px > kGrossViewRatio * expected;
    if (view.rms_px <= kBadViewRatio * expected && share <= kBadViewOutliers && !gross) continue;
    reasons.push_back(
        fmt::format("station {} is bad in {}: RMS {:.2f} px where {:.2f} px is usual, {:.0f} % of its {} left out; "
                    "look at the image, "
                    "or exclude it with the reason",
                    place_name(calibration, view), calibration.bundle.state.rig.sensors[view.sensor].name,
                    view.rms_all_px, expected, 100 * share, name_of(view.kind)));
  }
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
    if (share > kGroupOutliers) {
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

void judge_geometry(const Calibration& calibration, std::vector<std::string>& reasons) {
  const CalibrationState& state = calibration.bundle.state;
  // An earlier rig had boards enough.
  if (!calibration.earlier) {
    judge_boards(Mount::probe, calibration.bundle, reasons);
    judge_boards(Mount::world, calibration.bundle, reasons);
  }
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    const Sensor& sensor = state.rig.sensors[s];
    const Eigen::MatrixXd covariance = calibration.bundle.covariance.of({{BlockId::Kind::lens, s}}, state);
    const double relative = std::sqrt(covariance(0, 0)) / sensor.lens.parameters()[0];
    if (relative > kFocalUncertainty) {
      reasons.push_back(fmt::format("{}: the focal length is known to {:.1f} % only: add tilts and distances",
                                    sensor.name, 100 * relative));
    }
  }
  const bool held_by_priors = !calibration.bundle.undetermined.empty();
  if (calibration.bundle.covariance.condition() > kIllConditioned && !held_by_priors) {
    reasons.push_back(fmt::format("{} can hardly be told apart: choose a lens model with fewer terms or add views",
                                  calibration.bundle.covariance.weakest_direction()));
  }
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
    // What the observations say of its directions: the prior's variance less what is left of it.
    const Eigen::MatrixXd covariance = bundle.covariance.of(prior.blocks(), bundle.state);
    const double degrees = static_cast<double>(jacobian.rows()) - (jacobian * covariance).cwiseProduct(jacobian).sum();
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
    reasons.push_back(fmt::format(
        "{} scatter by {:.2f} px where {:.2f} px is usual of the earlier rig: is this another probe or tracker?", name,
        group.sigma_px, usual->second));
  }
}

std::vector<std::string> notes_on(const BundleResult& bundle) {
  constexpr std::size_t kNamed = 6;
  std::vector<std::string> notes;
  for (const Undetermined& undetermined : bundle.undetermined) {
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

}  // namespace

Verdict judge(const Calibration& calibration) {
  Verdict verdict;
  judge_views(calibration, verdict.reasons);
  judge_groups(calibration.bundle, verdict.reasons);
  judge_geometry(calibration, verdict.reasons);
  if (calibration.earlier) judge_earlier(calibration, verdict.reasons);
  verdict.notes = notes_on(calibration.bundle);
  verdict.ok = verdict.reasons.empty();
  return verdict;
}

}  // namespace crumple
