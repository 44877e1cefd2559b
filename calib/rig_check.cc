#include "calib/rig_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "calib/correlation.h"
#include "calib/rig_prior.h"
#include "calib/rig_truth.h"
#include "calib/start_from_rig.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr double kFalseAlarm = 1e-3;  // over all parts together
constexpr double kThere = 0.1;        // of the distance
constexpr double kSeen = 0.8;         // probability that a change of the stated size shows
constexpr double kVague = 1e4;        // of variances: no change of the rig contradicts it
constexpr double kAsGood = 9;         // of the sum of squares: 3 sigma
constexpr double kMostNoise = 5;      // over what the rig knows; beyond it is the rig that does not fit
constexpr double kDegrees = 180 / std::numbers::pi;

struct Refined {
  BundleResult bundle;
  double square_sum = 0;
  Prior prior;
};

// The shortest change that raises the sum of squares by `noncentrality` whatever its direction.
std::optional<double> shortest_seen(const Eigen::MatrixXd& information, double noncentrality) {
  const double least = symmetric_eigen(information).values[0];
  return least > 0 ? std::optional(std::sqrt(noncentrality / least)) : std::nullopt;
}

// Schwarz's criterion: a part with more parameters has to explain more. A lens can stand in for a turned mount.
double score(const PartCheck& part, double observations) {
  return part.gain - std::log(std::max(observations, 2.0)) * part.degrees;
}

// `views`: of all observations, those of stripes in the order of `all`.
std::vector<StripeView> accepted_stripes(const std::vector<StripeView>& all, const std::vector<ViewSummary>& views) {
  std::vector<StripeView> kept;
  auto stripes = all.begin();
  for (const ViewSummary& summary : views) {
    if (summary.kind != View::Kind::stripes) continue;
    StripeView view = *stripes++;
    view.camera_pixels.clear();
    view.coordinates_px.clear();
    for (std::size_t i = 0; i < summary.inlier.size(); ++i) {
      if (!summary.inlier[i]) continue;
      view.camera_pixels.push_back(std::prev(stripes)->camera_pixels[i]);
      view.coordinates_px.push_back(std::prev(stripes)->coordinates_px[i]);
    }
    if (!view.camera_pixels.empty()) kept.push_back(std::move(view));
  }
  return kept;
}

class Checker {
 public:
  Checker(const CalibrationData& data, const EarlierRig& earlier, CalibrationState start, int threads)
      : data_(data), earlier_(earlier), start_(std::move(start)) {
    options_.reject_outliers = false;
    options_.known_sigma_px = earlier.rig.sigma_px;
    options_.estimate_known_sigmas = false;
    options_.estimate_warp = true;
    options_.threads = threads;
  }

  // Boards are bent, or flat where too little of them is seen to tell.
  void settle_warp() { options_.estimate_warp = refine_without({}).has_value(); }

  // What no rig of the kind explains says nothing of a change: stripes' readings that are errors of decoding, and LEDs'
  // noise beyond what the rig knows.
  Expected<void> look_without_the_rig() {
    if (data_.observations.stripes.empty() && data_.observations.leds.empty()) return {};
    Rig vague = earlier_.rig;
    vague.covariance.matrix *= kVague;
    const auto known = rig_prior(vague, start_, data_.observations);
    if (!known) return tl::unexpected(known.error());
    BundleOptions options = options_;
    options.reject_outliers = true;
    options.estimate_known_sigmas = true;
    options.priors = {known->prior};
    options.held = known->held;
    options.freed = known->freed;
    const auto bundle = refine(start_, data_.observations, options);
    if (!bundle) return tl::unexpected(bundle.error());
    data_.observations.stripes = accepted_stripes(data_.observations.stripes, bundle->views);
    for (const GroupSummary& group : bundle->groups) {
      if (group.kind != View::Kind::leds || !group.sigma_estimated) continue;
      const auto known_px = options_.known_sigma_px.find(group_name(start_.rig, group.sensor, group.kind));
      if (known_px == options_.known_sigma_px.end()) continue;
      const double noisier = std::clamp(group.sigma_px / known_px->second, 1.0, kMostNoise);
      if (noisier > 1) noisier_[known_px->first] = noisier;
      known_px->second *= noisier;
    }
    return {};
  }

  // Everything unchanged. Settles how many correlated observations count as one.
  Expected<Refined> refine_unchanged() {
    auto independent = refine_without({});
    if (!independent) return independent;
    const Inflation counted = inflation(data_.observations, independent->bundle, options_.threads);
    options_.corner_inflation = counted.corners;
    options_.stripe_inflation = counted.stripes;
    return refine_without({});
  }

  // With some blocks unknown beforehand.
  Expected<Refined> refine_without(const std::set<BlockId>& changed) {
    const auto known = rig_prior(earlier_.rig, start_, data_.observations, changed);
    if (!known) return tl::unexpected(known.error());
    BundleOptions options = options_;
    options.priors = {known->prior};
    options.held = known->held;
    options.freed = known->freed;
    options.freed.insert(changed.begin(), changed.end());
    for (const BlockId& block : changed) options.held.erase(block);
    auto bundle = refine(start_, data_.observations, options);
    if (!bundle) return tl::unexpected(bundle.error());
    const double sum = known->prior.evaluate(bundle->state).residuals.squaredNorm() + square_sum(*bundle);
    return Refined{std::move(*bundle), sum, known->prior};
  }

  const std::map<std::string, double>& noisier() const { return noisier_; }

  double redundancy(const Refined& unchanged) const {
    double sum = 0;
    for (const GroupSummary& group : unchanged.bundle.groups) {
      sum += group.redundancy / inflation_of(group.kind, options_);
    }
    return sum;
  }

  // What the observations touch and the rig knows: mounts, lenses, LEDs.
  std::vector<PartCheck> parts(const Refined& unchanged) const {
    std::set<BlockId> touched;
    for (const auto& view : make_views(data_.observations, start_.board_of)) {
      touched.insert(view->blocks().begin(), view->blocks().end());
    }
    std::vector<PartCheck> parts;
    for (const BlockId& block : touched) {
      std::string name = name_of_part(block);
      if (name.empty()) continue;
      PartCheck part;
      part.block = block;
      part.name = std::move(name);
      part.degrees = tangent_size(block, unchanged.bundle.state);
      parts.push_back(std::move(part));
    }
    for (PartCheck& part : parts) state_limits(unchanged, static_cast<double>(parts.size()), part);
    return parts;
  }

  void describe(const Refined& freed, PartCheck& part) const {
    part.change = block_step(part.block, start_, freed.bundle.state);
    if (part.block.kind == BlockId::Kind::mount) {
      part.how_far = fmt::format("{:.3g} mm and {:.3g} deg", part.change.tail<3>().norm(),
                                 part.change.head<3>().norm() * kDegrees);
    } else if (part.block.kind == BlockId::Kind::led) {
      part.how_far = fmt::format("{:.3g} mm", part.change.norm());
      const Eigen::Vector3d now = freed.bundle.state.rig.leds[part.block.index].position_mm;
      for (std::size_t l = 0; l < start_.rig.leds.size(); ++l) {
        const bool there = (start_.rig.leds[l].position_mm - now).norm() < kThere * part.change.norm();
        if (l != part.block.index && there)
          part.how_far += fmt::format(", to where LED {} was", start_.rig.leds[l].name);
      }
    } else {
      const auto pixels = lens_error_px(freed.bundle.state.rig.sensors[part.block.index].lens,
                                        start_.rig.sensors[part.block.index].lens);
      part.how_far = pixels ? fmt::format("{:.3g} px, RMS over the image", *pixels) : "beyond comparison";
    }
  }

 private:
  void state_limits(const Refined& unchanged, double parts, PartCheck& part) const {
    const std::vector<BlockId>& blocks = unchanged.prior.blocks();
    const auto at = std::find(blocks.begin(), blocks.end(), part.block) - blocks.begin();
    if (part.block.kind == BlockId::Kind::lens || at == static_cast<std::ptrdiff_t>(blocks.size())) return;
    const WhitenedPrior prior = unchanged.prior.evaluate(unchanged.bundle.state);
    Eigen::MatrixXd whole(prior.residuals.size(), 0);
    for (const RowMajorMatrix& block : prior.jacobians) {
      whole.conservativeResize(Eigen::NoChange, whole.cols() + block.cols());
      whole.rightCols(block.cols()) = block;
    }
    const Eigen::MatrixXd covariance = unchanged.bundle.covariance.of(blocks, unchanged.bundle.state);
    const Eigen::MatrixXd own = prior.jacobians[static_cast<std::size_t>(at)];
    const Eigen::MatrixXd with_all = whole.transpose() * own;
    const Eigen::MatrixXd information = own.transpose() * own - with_all.transpose() * covariance * with_all;
    const double noncentrality =
        noncentrality_seen(chi_square_exceeded(kFalseAlarm / parts, part.degrees), part.degrees, kSeen);
    part.would_show_mm = shortest_seen(information.bottomRightCorner<3, 3>(), noncentrality);
    if (part.block.kind != BlockId::Kind::mount) return;
    const auto turn_rad = shortest_seen(information.topLeftCorner<3, 3>(), noncentrality);
    if (turn_rad) part.would_show_deg = *turn_rad * kDegrees;
  }

  double square_sum(const BundleResult& bundle) const {
    double sum = 0;
    for (const ViewSummary& view : bundle.views) {
      const auto group = std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& g) {
        return g.sensor == view.sensor && g.kind == view.kind;
      });
      const double counted = inflation_of(view.kind, options_);
      sum += view.residuals_px.squaredNorm() / (group->sigma_px * group->sigma_px * counted);
    }
    return sum;
  }

  std::string name_of_part(const BlockId& block) const {
    if (block.kind == BlockId::Kind::led) {
      const Led& led = start_.rig.leds[block.index];
      const bool known = std::any_of(earlier_.rig.leds.begin(), earlier_.rig.leds.end(),
                                     [&](const Led& l) { return l.name == led.name; });
      return known ? fmt::format("LED {}", led.name) : "";
    }
    if (block.kind != BlockId::Kind::mount && block.kind != BlockId::Kind::lens) return "";
    const Sensor& sensor = start_.rig.sensors[block.index];
    if (!earlier_.rig.find(sensor.name)) return "";
    if (block.kind == BlockId::Kind::lens) {
      return sensor.lens_of ? "" : fmt::format("the lens of {}", sensor.name);
    }
    // A mount alone on its carrier is the frame itself.
    const auto on_mount = std::count_if(start_.rig.sensors.begin(), start_.rig.sensors.end(),
                                        [&](const Sensor& s) { return s.mount == sensor.mount; });
    return on_mount > 1 ? fmt::format("the place of {}", sensor.name) : "";
  }

  CalibrationData data_;
  const EarlierRig& earlier_;
  CalibrationState start_;
  BundleOptions options_;
  std::map<std::string, double> noisier_;  // by group
};

}  // namespace

Expected<RigCheck> check_rig(const CalibrationData& data, const EarlierRig& earlier, int threads) {
  auto start = start_from_rig(data, earlier.rig, earlier.board_scales);
  if (!start) return tl::unexpected(start.error());
  const EarlierRig known{.rig = without_bars(earlier.rig, data), .board_scales = earlier.board_scales};
  Checker checker(data, known, std::move(*start), threads);
  checker.settle_warp();
  if (auto done = checker.look_without_the_rig(); !done) return tl::unexpected(done.error());
  auto current = checker.refine_unchanged();
  if (!current) return tl::unexpected(current.error());
  RigCheck check{current->square_sum, checker.redundancy(*current), checker.parts(*current), {}, checker.noisier()};
  double degrees = check.redundancy;
  std::set<BlockId> changed;
  for (;;) {
    std::size_t worst = 0;
    std::optional<Refined> best;
    for (std::size_t p = 0; p < check.parts.size(); ++p) {
      PartCheck& part = check.parts[p];
      if (changed.contains(part.block)) continue;
      std::set<BlockId> freed = changed;
      freed.insert(part.block);
      auto refined = checker.refine_without(freed);
      if (!refined) continue;  // the observations do not determine it: nothing is tested then
      part.gain = std::max(0.0, current->square_sum - refined->square_sum);
      part.probability = chi_square_tail(part.gain, part.degrees);
      checker.describe(*refined, part);
      if (part.probability > kFalseAlarm / static_cast<double>(check.parts.size())) continue;
      if (best && score(check.parts[worst], check.redundancy) >= score(part, check.redundancy)) continue;
      worst = p;
      best = std::move(*refined);
    }
    if (!best) {
      check.probability = chi_square_tail(current->square_sum, std::max(1, static_cast<int>(std::ceil(degrees))));
      return check;
    }
    PartChange found{worst};
    for (std::size_t p = 0; p < check.parts.size(); ++p) {
      const bool tested = p != worst && !changed.contains(check.parts[p].block);
      if (tested && score(check.parts[p], check.redundancy) > score(check.parts[worst], check.redundancy) - kAsGood)
        found.or_else.push_back(p);
    }
    changed.insert(check.parts[worst].block);
    degrees -= check.parts[worst].degrees;
    check.changed.push_back(std::move(found));
    current = std::move(*best);
  }
}

}  // namespace crumple
