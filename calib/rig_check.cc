#include "calib/rig_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/correlation.h"
#include "calib/moved_sensor.h"
#include "calib/rig_prior.h"
#include "calib/rig_truth.h"
#include "calib/start_from_rig.h"
#include "calib/telling_readings.h"
#include "calib/tracker_move.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"
#include "solvers/gate.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr double kFalseAlarm = 1e-3;  // over all parts together, and over all groups
constexpr double kThere = 0.1;        // of the distance
constexpr double kSeen = 0.8;         // probability that a change of the stated size shows
constexpr double kVague = 1e4;        // of variances: no change of the rig contradicts it
constexpr double kAsGood = 9;         // of the sum of squares: 3 sigma
constexpr double kOwnNoise = 20;      // degrees of freedom from which on a tracker's noise is told by its own readings
constexpr double kMostNoise = 5;      // over what the rig knows; beyond it is the rig that does not fit
constexpr double kDegrees = 180 / std::numbers::pi;

struct Refined {
  BundleResult bundle;
  double square_sum = 0;
  Prior prior;
};

// By all blocks, beside each other.
Eigen::MatrixXd whole_jacobian(const WhitenedPrior& prior) {
  Eigen::MatrixXd whole(prior.residuals.size(), 0);
  for (const RowMajorMatrix& block : prior.jacobians) {
    whole.conservativeResize(Eigen::NoChange, whole.cols() + block.cols());
    whole.rightCols(block.cols()) = block;
  }
  return whole;
}

// The shortest change that raises the sum of squares by `noncentrality` whatever its direction.
std::optional<double> shortest_seen(const Eigen::MatrixXd& information, double noncentrality) {
  const double least = symmetric_eigen(information).values[0];
  return least > 0 ? std::optional(std::sqrt(noncentrality / least)) : std::nullopt;
}

// Probability that a sigma told by so many degrees of freedom comes out so many times as large as it is.
double exceeded_by_chance(double times, double redundancy) {
  const int degrees = static_cast<int>(std::lround(redundancy));
  return degrees > 0 ? chi_square_tail(times * times * redundancy, degrees) : 1;
}

// Schwarz's criterion: a part with more parameters has to explain more. A lens can stand in for a turned mount.
double score(double gain, int degrees, double observations) {
  return gain - std::log(std::max(observations, 2.0)) * degrees;
}
double score(const PartCheck& part, double observations) { return score(part.gain, part.degrees, observations); }

// The noise of groups, of moved sensors as before their move.
std::map<std::string, double> with_moved(std::map<std::string, double> sigma_px, const std::vector<SensorSpec>& sensors,
                                         const Rig& rig) {
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (!sensors[s].lens_of) continue;
    for (const View::Kind kind : {View::Kind::leds, View::Kind::corners}) {
      const auto before = sigma_px.find(group_name(rig, *sensors[s].lens_of, kind));
      if (before != sigma_px.end()) sigma_px.emplace(group_name(rig, s, kind), before->second);
    }
  }
  return sigma_px;
}

class Checker {
 public:
  Checker(const CalibrationData& data, const EarlierRig& earlier, CalibrationState start, int threads)
      : data_(data), earlier_(earlier), start_(std::move(start)) {
    options_.reject_outliers = false;
    options_.known_sigma_px = known_sigma_px_ = with_moved(earlier.rig.sigma_px, data.sensors, start_.rig);
    options_.estimate_known_sigmas = false;
    options_.estimate_warp = true;
    options_.threads = threads;
  }

  // Boards are bent, or flat where too little of them is seen to tell.
  void settle_warp() { options_.estimate_warp = refine_without({}).has_value(); }

  // What no rig of the kind explains says nothing of a change: stripes' readings that are errors of decoding, LEDs that
  // were misread, and their noise beyond what the rig knows.
  Expected<void> look_without_the_rig() {
    if (data_.observations.stripes.empty() && data_.observations.leds.empty()) return {};
    Rig vague = earlier_.rig;
    vague.covariance.matrix *= kVague;
    const auto known = rig_prior(vague, start_, data_.observations);
    if (!known) return tl::unexpected(known.error());
    BundleOptions options = options_;
    options.reject_outliers = true;
    options.estimate_known_sigmas = true;
    options.minimum_redundancy = kOwnNoise;
    options.priors = {known->prior};
    options.held = known->held;
    options.freed = known->freed;
    auto bundle = refine(start_, data_.observations, options);
    if (!bundle) return tl::unexpected(bundle.error());
    data_.observations.stripes = accepted_stripes(data_.observations.stripes, bundle->views);
    settle_led_noise(*bundle);
    // Once more with the weights that this gives trackers of which few readings are left.
    options.known_sigma_px = options_.known_sigma_px;
    options.estimate_known_sigmas = false;
    bundle = refine(start_, data_.observations, options);
    if (!bundle) return tl::unexpected(bundle.error());
    data_.observations.leds = telling_leds(data_.observations.leds, bundle->views);
    settle_led_noise(*bundle);
    return {};
  }

  // By group what it scatters over what the rig knows; groups of which too few readings are left to tell, all together.
  void settle_led_noise(const BundleResult& bundle) {
    struct Group {
      std::size_t sensor;
      double square, redundancy;
    };
    noisier_.clear();
    std::vector<Group> groups;
    double square = 0, redundancy = 0;
    for (const GroupSummary& summary : bundle.groups) {
      if (summary.kind != View::Kind::leds) continue;
      const auto known_px = known_sigma_px_.find(group_name(start_.rig, summary.sensor, summary.kind));
      if (known_px == known_sigma_px_.end()) continue;
      const auto accepted = static_cast<double>(summary.observations - summary.outliers);
      const double times = summary.rms_px / known_px->second;
      groups.push_back({summary.sensor, times * times * accepted, summary.redundancy});
      square += groups.back().square;
      redundancy += groups.back().redundancy;
    }
    const double kept = kept_variance(2, options_.gate);
    for (Group group : groups) {
      if (group.redundancy < kOwnNoise) group = {group.sensor, square, redundancy};
      if (group.redundancy < kOwnNoise) continue;
      const double noisier = std::clamp(std::sqrt(group.square / (group.redundancy * kept)), 1.0, kMostNoise);
      const std::string name = group_name(start_.rig, group.sensor, View::Kind::leds);
      options_.known_sigma_px.at(name) = noisier * known_sigma_px_.at(name);
      if (exceeded_by_chance(noisier, group.redundancy) > kFalseAlarm / static_cast<double>(groups.size())) continue;
      double& told = noisier_[group_name(start_.rig, as_calibrated(group.sensor), View::Kind::leds)];
      told = std::max(told, noisier);
    }
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
  Expected<Refined> refine_without(const std::set<BlockId>& changed) const {
    return refine_under_rig(start_, data_.observations, options_, changed);
  }

  // With a tracker at two places, of `data` as below.
  Expected<Refined> refine_moved(const CalibrationData& seen, const Move& move) const {
    const CalibrationData data = with_move(seen, move);
    const auto start = start_from_rig(data, earlier_.rig, earlier_.board_scales);
    if (!start) return tl::unexpected(start.error());
    BundleOptions options = options_;
    options.known_sigma_px = with_moved(options.known_sigma_px, data.sensors, start->rig);
    return refine_under_rig(*start, data.observations, options, {});
  }

  const CalibrationData& data() const { return data_; }

  // What tells of a tracker's moves: everything, or, where what it saw nobody knows when does not tell a third place,
  // such as a bar's two ends, what is left without that.
  CalibrationData telling_moves(const CalibrationData& data, const Move& any) const {
    const bool told = start_from_rig(with_move(data, any), earlier_.rig, earlier_.board_scales).has_value();
    return told ? data : without_untimed(data, any.sensor);
  }
  Expected<Refined> refine_unmoved(const CalibrationData& data) const {
    const auto start = start_from_rig(data, earlier_.rig, earlier_.board_scales);
    if (!start) return tl::unexpected(start.error());
    return refine_under_rig(*start, data.observations, options_, {});
  }

  const std::map<std::string, double>& noisier() const { return noisier_; }

  double redundancy(const Refined& unchanged) const {
    double sum = 0;
    for (const GroupSummary& group : unchanged.bundle.groups) {
      sum += group.redundancy / inflation_of(group.kind, options_);
    }
    const WhitenedPrior prior = unchanged.prior.evaluate(unchanged.bundle.state);
    const Eigen::MatrixXd whole = whole_jacobian(prior);
    const Eigen::MatrixXd covariance = unchanged.bundle.covariance.of(unchanged.prior.blocks(), unchanged.bundle.state);
    const double learnt = (whole * covariance).cwiseProduct(whole).sum();
    return sum + std::max(0.0, static_cast<double>(prior.residuals.size()) - learnt);
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
      const SensorStep step(start_.rig.sensors[part.block.index], freed.bundle.state.rig.sensors[part.block.index]);
      part.how_far = fmt::format("{:.3g} mm and {:.3g} deg", step.place_mm, step.turn_rad * kDegrees);
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
  // Of a place that the rig does not have, the one of the same sensor that it has.
  std::size_t as_calibrated(std::size_t sensor) const {
    const bool is_new = !earlier_.rig.find(start_.rig.sensors[sensor].name);
    return is_new ? start_.rig.sensors[sensor].lens_of.value_or(sensor) : sensor;
  }

  void state_limits(const Refined& unchanged, double parts, PartCheck& part) const {
    const std::vector<BlockId>& blocks = unchanged.prior.blocks();
    const auto at = std::find(blocks.begin(), blocks.end(), part.block) - blocks.begin();
    if (part.block.kind == BlockId::Kind::lens || at == static_cast<std::ptrdiff_t>(blocks.size())) return;
    const WhitenedPrior prior = unchanged.prior.evaluate(unchanged.bundle.state);
    const Eigen::MatrixXd whole = whole_jacobian(prior);
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

  Expected<Refined> refine_under_rig(const CalibrationState& start, const Observations& observations,
                                     BundleOptions options, const std::set<BlockId>& changed) const {
    const auto known = rig_prior(earlier_.rig, start, observations, changed);
    if (!known) return tl::unexpected(known.error());
    options.priors = {known->prior};
    options.held = known->held;
    options.freed = known->freed;
    options.freed.insert(changed.begin(), changed.end());
    for (const BlockId& block : changed) options.held.erase(block);
    auto bundle = refine(start, observations, options);
    if (!bundle) return tl::unexpected(bundle.error());
    const double sum = known->prior.evaluate(bundle->state).residuals.squaredNorm() + square_sum(*bundle);
    return Refined{std::move(*bundle), sum, known->prior};
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

  CalibrationData data_;  // what tells of the rig
  const EarlierRig& earlier_;
  CalibrationState start_;
  BundleOptions options_;
  std::map<std::string, double> known_sigma_px_;  // of the rig
  std::map<std::string, double> noisier_;         // by group
};

Expected<Checker> look_at(const CalibrationData& data, const EarlierRig& known, int threads) {
  auto start = start_from_rig(data, known.rig, known.board_scales);
  if (!start) return tl::unexpected(start.error());
  Checker checker(data, known, std::move(*start), threads);
  checker.settle_warp();
  if (auto done = checker.look_without_the_rig(); !done) return tl::unexpected(done.error());
  return checker;
}

// What changed from one calibration to the next, as far as parts are concerned.
struct TestedParts {
  RigCheck check;
  double explained = 0;  // by the changes, of the sum of squares
  int degrees = 0;       // that they took
  bool sound() const { return check.changed.empty() && check.noisier.empty() && check.probability >= kFalseAlarm; }
};

TestedParts test_parts(const Checker& checker, Refined current) {
  const double unchanged = current.square_sum;
  RigCheck check{unchanged, checker.redundancy(current), checker.parts(current), {}, checker.noisier()};
  int degrees = 0;
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
      part.gain = std::max(0.0, current.square_sum - refined->square_sum);
      part.probability = chi_square_tail(part.gain, part.degrees);
      checker.describe(*refined, part);
      if (part.probability > kFalseAlarm / static_cast<double>(check.parts.size())) continue;
      if (best && score(check.parts[worst], check.redundancy) >= score(part, check.redundancy)) continue;
      worst = p;
      best = std::move(*refined);
    }
    if (!best) break;
    PartChange found{worst};
    for (std::size_t p = 0; p < check.parts.size(); ++p) {
      const bool tested = p != worst && !changed.contains(check.parts[p].block);
      if (tested && score(check.parts[p], check.redundancy) > score(check.parts[worst], check.redundancy) - kAsGood)
        found.or_else.push_back(p);
    }
    changed.insert(check.parts[worst].block);
    degrees += check.parts[worst].degrees;
    check.changed.push_back(std::move(found));
    current = std::move(*best);
  }
  const double left = check.redundancy - degrees;
  check.probability = chi_square_tail(current.square_sum, std::max(1, static_cast<int>(std::ceil(left))));
  return {std::move(check), unchanged - current.square_sum, degrees};
}

struct TestedMove {
  Move move;
  double score = 0;
  SensorStep step;
};

// Of each tracker the likeliest that is less likely by chance than over all moves together, the likeliest of all first.
std::vector<TestedMove> test_moves(const Checker& checker, const Refined& unchanged) {
  const double redundancy = checker.redundancy(unchanged);
  const std::vector<Move> moves = possible_moves(checker.data());
  const std::size_t later = checker.data().sensors.size();
  std::map<std::size_t, TestedMove> best;
  std::optional<std::size_t> sensor;
  CalibrationData seen;
  double square_sum = 0;
  for (const Move& move : moves) {
    if (sensor != move.sensor) {
      sensor = move.sensor;
      seen = checker.telling_moves(checker.data(), move);
      const auto unmoved = checker.refine_unmoved(seen);
      square_sum = unmoved ? unmoved->square_sum : 0;
    }
    const auto refined = checker.refine_moved(seen, move);
    if (!refined) continue;  // not determined
    const auto& sensors = refined->bundle.state.rig.sensors;
    const int degrees = 6 * static_cast<int>(sensors.size() - later);
    const double gain = std::max(0.0, square_sum - refined->square_sum);
    if (chi_square_tail(gain, degrees) > kFalseAlarm / static_cast<double>(moves.size())) continue;
    const TestedMove tested{move, score(gain, degrees, redundancy), SensorStep(sensors[move.sensor], sensors[later])};
    const auto [known, is_new] = best.emplace(move.sensor, tested);
    if (!is_new && tested.score > known->second.score) known->second = tested;
  }
  std::vector<TestedMove> found;
  for (const auto& [moved, tested] : best) found.push_back(tested);
  std::stable_sort(found.begin(), found.end(),
                   [](const TestedMove& a, const TestedMove& b) { return a.score > b.score; });
  return found;
}

MovedMeanwhile told(const std::vector<TestedMove>& as_good, const CalibrationData& data) {
  MovedMeanwhile moved;
  std::vector<std::string> clauses;
  for (const TestedMove& tested : as_good) {
    const std::string& name = data.sensors[tested.move.sensor].name;
    moved.trackers.push_back(name);
    clauses.push_back(moved_clause(name, data.station_names[tested.move.first_station], tested.step));
  }
  moved.first_station = as_good.front().move.first_station;
  moved.what = fmt::format("{}{}", clauses.size() > 1 ? "either " : "", fmt::join(clauses, " or "));
  return moved;
}

}  // namespace

Expected<RigCheck> check_rig(const CalibrationData& data, const EarlierRig& earlier, int threads) {
  const EarlierRig known{.rig = without_bars(earlier.rig, data), .board_scales = earlier.board_scales};
  auto checker = look_at(data, known, threads);
  if (!checker) return tl::unexpected(checker.error());
  const auto unchanged = checker->refine_unchanged();
  if (!unchanged) return tl::unexpected(unchanged.error());
  TestedParts tested = test_parts(*checker, *unchanged);
  if (tested.sound()) return std::move(tested.check);
  std::vector<TestedMove> moves = test_moves(*checker, *unchanged);
  const double by_parts = score(tested.explained, tested.degrees, tested.check.redundancy);
  if (moves.empty() || moves.front().score < by_parts + kAsGood) return std::move(tested.check);
  std::erase_if(moves, [&](const TestedMove& move) { return move.score < moves.front().score - kAsGood; });
  const Move& likeliest = moves.front().move;
  const CalibrationData at_two_places = with_move(checker->telling_moves(data, likeliest), likeliest);
  auto rest = look_at(at_two_places, known, threads);
  const auto otherwise_unchanged = rest ? rest->refine_unchanged() : Expected<Refined>(tl::unexpected(rest.error()));
  RigCheck check = std::move(tested.check);
  // Too little is left to tell what else did.
  check.changed.clear();
  check.parts.clear();
  check.noisier.clear();
  check.probability = 1;
  if (otherwise_unchanged) check = test_parts(*rest, *otherwise_unchanged).check;
  check.moved = told(moves, data);
  return check;
}

}  // namespace crumple
