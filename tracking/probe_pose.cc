#include "tracking/probe_pose.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "solvers/closed_form/plane.h"
#include "tracking/pose_fit.h"
#include "tracking/pose_starts.h"

namespace crumple {
namespace {

constexpr std::size_t kMostTriples = 60;  // per tracker
constexpr std::size_t kRefinedStarts = 4;
constexpr double kCauchyScale = 2;
constexpr double kMirrorMargin = 16;        // of chi-square, by which the mirrored pose has to be worse
constexpr double kDecidingShare = 1.0 / 3;  // of the turn between two poses, within which one is near
constexpr std::size_t kFewLeftOut = 8;      // one in so many
constexpr int kMostRounds = 40;             // of leaving out and taking back

using Used = std::vector<char>;

std::size_t count_used(const Used& used) { return static_cast<std::size_t>(std::count(used.begin(), used.end(), 1)); }

Expected<void> check_layout(const std::vector<LedSighting>& sightings, const Used& used) {
  std::set<std::size_t> leds;
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (used[i] && leds.insert(sightings[i].led).second) positions.push_back(sightings[i].led_mm);
  }
  if (positions.size() < 3) {
    return fail(fmt::format("{} LEDs of the probe are told: a pose needs three, so turn it towards a tracker",
                            positions.size()));
  }
  if (!fit_plane(positions)) {
    return fail("the LEDs that are told lie on a line, so the probe's turn about it is open: turn it to show others");
  }
  return {};
}

double cut_sum(const std::vector<LedSighting>& sightings, const Pose& pose, double gate) {
  double sum = 0;
  SightingResidual at;
  for (const LedSighting& s : sightings) {
    sum += evaluate(s, pose, at) ? std::min(gate, at.residual_px.dot(s.information * at.residual_px)) : gate;
  }
  return sum;
}

// By a Cauchy loss that narrows from half of the median residual: at its final width at once, a start that wrong
// readings have pulled away would be held by whatever happens to be near.
std::optional<PoseFit> robust_fit(const std::vector<LedSighting>& sightings, const Pose& start) {
  std::vector<double> squares;
  SightingResidual at;
  for (const LedSighting& s : sightings) {
    if (evaluate(s, start, at)) squares.push_back(at.residual_px.dot(s.information * at.residual_px));
  }
  if (squares.empty()) return std::nullopt;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  std::optional<PoseFit> fit = PoseFit{.world_from_probe = start};
  const Used all(sightings.size(), 1);
  for (double scale = std::max(kCauchyScale, std::sqrt(*middle) / 2); fit; scale = std::max(kCauchyScale, scale / 4)) {
    fit = fit_pose(sightings, all, fit->world_from_probe, {.cauchy_scale = scale});
    if (scale <= kCauchyScale) break;
  }
  return fit;
}

struct PoseCandidate {
  PoseFit fit;
  Used used;
};

bool all_within(const std::vector<LedSighting>& sightings, const PoseFit& fit, double gate) {
  return std::all_of(sightings.begin(), sightings.end(),
                     [&](const LedSighting& s) { return standardised_square(s, true, fit) < gate; });
}

// The best fit to all readings, where none of them is to be doubted.
std::optional<PoseCandidate> undoubted(const std::vector<LedSighting>& sightings, const std::vector<Pose>& starts,
                                       double gate) {
  const Used all(sightings.size(), 1);
  std::optional<PoseCandidate> best;
  for (const Pose& start : starts) {
    const auto fit = fit_pose(sightings, all, start);
    if (!fit || (best && fit->cost >= best->fit.cost) || !all_within(sightings, *fit, gate)) continue;
    best = PoseCandidate{*fit, all};
  }
  return best;
}

// Leaves out the worst and takes back what fits, until nothing changes.
std::optional<PoseCandidate> gated(const std::vector<LedSighting>& sightings, const PoseFit& start, double gate) {
  PoseCandidate result{start, Used(sightings.size(), 0)};
  SightingResidual at;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    result.used[i] = evaluate(sightings[i], start.world_from_probe, at) &&
                     at.residual_px.dot(sightings[i].information * at.residual_px) < 2 * gate;
  }
  Used taken_back(sightings.size(), 0);
  for (int round = 0; round < kMostRounds; ++round) {
    if (!check_layout(sightings, result.used)) return std::nullopt;
    const auto fit = fit_pose(sightings, result.used, result.fit.world_from_probe);
    if (!fit) return std::nullopt;
    result.fit = *fit;
    double worst = gate;
    std::optional<std::size_t> change;
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      const double square = standardised_square(sightings[i], result.used[i], *fit);
      if (result.used[i] && square >= worst) {
        worst = square;
        change = i;
      }
    }
    for (std::size_t i = 0; i < sightings.size() && !change; ++i) {
      // Once each, or it might come and go for ever.
      if (result.used[i] || taken_back[i] || standardised_square(sightings[i], false, *fit) >= gate) continue;
      taken_back[i] = 1;
      change = i;
    }
    if (!change) return result;
    result.used[*change] ^= 1;
  }
  return std::nullopt;
}

// A robust fit from the first start, where it leaves out so few that the rest is beyond doubt: what one wrong ID among
// many or a reading at the gate needs.
std::optional<PoseCandidate> nearly_undoubted(const std::vector<LedSighting>& sightings,
                                              const std::vector<Pose>& starts, double gate) {
  if (starts.empty()) return std::nullopt;
  const auto robust = robust_fit(sightings, starts.front());
  if (!robust) return std::nullopt;
  auto found = gated(sightings, *robust, gate);
  if (found && kFewLeftOut * (sightings.size() - count_used(found->used)) <= sightings.size()) return found;
  return std::nullopt;
}

// Cut sums of squares pick the starts, then the numbers of readings that remain, then the sum of squares.
std::optional<PoseCandidate> consensus(const std::vector<LedSighting>& sightings, std::vector<Pose> starts,
                                       double gate) {
  const std::vector<Pose> triples = triple_starts(sightings, kMostTriples);
  starts.insert(starts.end(), triples.begin(), triples.end());
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < starts.size(); ++i) order.emplace_back(cut_sum(sightings, starts[i], 4 * gate), i);
  std::sort(order.begin(), order.end());
  std::optional<PoseCandidate> best;
  for (std::size_t i = 0; i < std::min(kRefinedStarts, order.size()); ++i) {
    const auto robust = robust_fit(sightings, starts[order[i].second]);
    if (!robust) continue;
    const auto candidate = gated(sightings, *robust, gate);
    if (!candidate) continue;
    const auto count = count_used(candidate->used), most = best ? count_used(best->used) : 0;
    if (count > most || (count == most && candidate->fit.cost < best->fit.cost)) best = candidate;
  }
  return best;
}

double distance_of_poses(const Pose& a, const Pose& b, double lever_mm) {
  return a.rotation.angularDistance(b.rotation) * lever_mm + (a.translation - b.translation).norm();
}

double lever_mm(const std::vector<LedSighting>& sightings) {
  double lever = 1;
  for (const LedSighting& s : sightings) lever = std::max(lever, s.led_mm.norm());
  return lever;
}

bool same_pose(const Pose& a, const Pose& b, const Matrix6d& covariance, double lever) {
  const Vector6d step = local_step(a, b);
  const double sigmas = (step.array().square() / covariance.diagonal().array()).maxCoeff();
  return sigmas < 1 || distance_of_poses(a, b, lever) < 1e-6 * lever;
}

// Other poses that explain the same readings, nearly as well or better. Where three LEDs are seen by two trackers
// there are none.
std::vector<PoseFit> rivals(const std::vector<LedSighting>& sightings, const PoseCandidate& found,
                            const std::vector<Pose>& starts) {
  std::map<std::size_t, int> trackers;
  for (std::size_t i = 0; i < sightings.size(); ++i) trackers[sightings[i].led] += found.used[i];
  if (std::count_if(trackers.begin(), trackers.end(), [](const auto& t) { return t.second >= 2; }) >= 3) return {};
  std::vector<Pose> others = mirrored(sightings, found.fit.world_from_probe);
  others.insert(others.end(), starts.begin(), starts.end());
  std::vector<PoseFit> result;
  const double lever = lever_mm(sightings);
  for (const Pose& start : others) {
    const auto fit = fit_pose(sightings, found.used, start);
    if (!fit || fit->cost > found.fit.cost + kMirrorMargin) continue;
    const auto same = [&](const PoseFit& known) {
      return same_pose(known.world_from_probe, fit->world_from_probe, known.covariance, lever);
    };
    if (!same(found.fit) && std::none_of(result.begin(), result.end(), same)) result.push_back(*fit);
  }
  return result;
}

// Where the probe would be and where its z axis would point.
std::string place_words(const Pose& world_from_probe) {
  const Eigen::Vector3d& at = world_from_probe.translation;
  const Eigen::Vector3d along = world_from_probe.rotation * Eigen::Vector3d::UnitZ();
  return fmt::format("at {:.0f} {:.0f} {:.0f} mm with its z axis along {:.2f} {:.2f} {:.2f}", at.x(), at.y(), at.z(),
                     along.x(), along.y(), along.z());
}

tl::unexpected<Error> nothing_decides(const std::vector<PoseFit>& alike) {
  std::string places;
  for (const PoseFit& fit : alike) places += (places.empty() ? "" : ", or ") + place_words(fit.world_from_probe);
  return fail(
      fmt::format("{} poses explain the LEDs' pixels alike (three LEDs, or a flat layout, seen by one tracker), the "
                  "probe {}: show more LEDs or a second tracker, or state roughly how it was turned (--near)",
                  alike.size(), places));
}

Expected<PoseChoice> choose(const std::vector<PoseFit>& alike, const NearPose& near, PoseCandidate& found) {
  const auto turn_to = [&](const PoseFit& fit) {
    return near.world_from_probe.rotation.angularDistance(fit.world_from_probe.rotation);
  };
  const auto nearest = std::min_element(alike.begin(), alike.end(),
                                        [&](const PoseFit& a, const PoseFit& b) { return turn_to(a) < turn_to(b); });
  PoseChoice choice{.poses = alike.size(),
                    .near = near.source,
                    .turn_rad = turn_to(*nearest),
                    .place_mm = (near.world_from_probe.translation - nearest->world_from_probe.translation).norm(),
                    .to_other_rad = std::numbers::pi};
  for (auto other = alike.begin(); other != alike.end(); ++other) {
    if (other == nearest) continue;
    choice.to_other_rad = std::min(
        choice.to_other_rad, nearest->world_from_probe.rotation.angularDistance(other->world_from_probe.rotation));
  }
  if (choice.turn_rad >= kDecidingShare * choice.to_other_rad) {
    constexpr double kDegree = std::numbers::pi / 180;
    return fail(fmt::format(
        "{} poses explain the LEDs' pixels alike, and {} does not decide between them: it is turned by {:.0f} deg from "
        "the nearest, where {:.0f} deg, a third of the turn from that to another, would be too much: show more LEDs or "
        "a second tracker, or state better how the probe was turned (--near)",
        alike.size(), near.source, choice.turn_rad / kDegree, kDecidingShare * choice.to_other_rad / kDegree));
  }
  found.fit = *nearest;
  return choice;
}

Expected<std::optional<PoseChoice>> settle_rivals(const std::vector<PoseFit>& others,
                                                  const std::optional<NearPose>& near, PoseCandidate& found) {
  if (others.empty()) return std::optional<PoseChoice>{};
  // A rival that is better by as much is the pose.
  double least = found.fit.cost;
  for (const PoseFit& other : others) least = std::min(least, other.cost);
  std::vector<PoseFit> alike;
  if (found.fit.cost < least + kMirrorMargin) alike.push_back(found.fit);
  for (const PoseFit& other : others) {
    if (other.cost < least + kMirrorMargin) alike.push_back(other);
  }
  if (alike.size() == 1) {
    found.fit = alike.front();
    return std::optional<PoseChoice>{};
  }
  if (!near) return nothing_decides(alike);
  const auto choice = choose(alike, *near, found);
  if (!choice) return tl::unexpected(choice.error());
  return std::optional<PoseChoice>(*choice);
}

Expected<void> check_evidence(const PoseCandidate& found, std::size_t readings) {
  const std::size_t used = count_used(found.used);
  if (used == readings) return {};
  if (2 * used <= readings || 2 * used < 8) {
    return fail(fmt::format(
        "the LED readings contradict each other: of {} only {} agree on a pose, too few to tell which are wrong. Check "
        "the LED positions, the rig and that nothing moved",
        readings, used));
  }
  return {};
}

ProbePose result_of(const std::vector<LedSighting>& sightings, const PoseCandidate& found) {
  ProbePose result{.world_from_probe = found.fit.world_from_probe,
                   .covariance = found.fit.covariance,
                   .chi_square = found.fit.cost,
                   .redundancy = 2 * static_cast<int>(count_used(found.used)) - 6,
                   .residuals = {}};
  SightingResidual at;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    LedResidual residual{.sensor = sightings[i].sensor, .led = sightings[i].led, .used = found.used[i] != 0};
    if (evaluate(sightings[i], result.world_from_probe, at)) residual.residual_px = at.residual_px;
    residual.standardised_square = standardised_square(sightings[i], residual.used, found.fit);
    result.residuals.push_back(residual);
  }
  return result;
}

}  // namespace

Expected<ProbePose> probe_pose(const Rig& rig, const LedReadings& readings, const ProbePoseOptions& options) {
  const auto sightings = led_sightings(rig, readings);
  if (!sightings) return tl::unexpected(sightings.error());
  if (auto sound = check_layout(*sightings, Used(sightings->size(), 1)); !sound) return tl::unexpected(sound.error());
  std::vector<Pose> starts = quick_starts(*sightings);
  if (options.near) starts.push_back(options.near->world_from_probe);
  auto found = undoubted(*sightings, starts, options.gate);
  if (!found) found = nearly_undoubted(*sightings, starts, options.gate);
  if (!found) found = consensus(*sightings, starts, options.gate);
  if (!found) {
    return fail(
        "no pose explains three LEDs: one tracker has to see three of them, or two trackers the same three, with "
        "their IDs right");
  }
  if (auto sound = check_evidence(*found, sightings->size()); !sound) return tl::unexpected(sound.error());
  const std::vector<PoseFit> others = rivals(*sightings, *found, starts);
  auto choice = settle_rivals(others, options.near, *found);
  if (!choice) return tl::unexpected(choice.error());
  ProbePose result = result_of(*sightings, *found);
  result.choice = std::move(*choice);
  return result;
}

}  // namespace crumple
