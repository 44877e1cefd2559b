#include "calib/rig_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

constexpr double kInfinite_mm = std::numeric_limits<double>::infinity();

struct Match {
  std::size_t a = 0, b = 0;
};

std::vector<Match> match_sensors(const Rig& a, const Rig& b, RigDifference& result) {
  std::vector<Match> matches;
  for (std::size_t s = 0; s < a.sensors.size(); ++s) {
    const auto again = b.find(a.sensors[s].name);
    if (!again) {
      result.only_a.push_back(a.sensors[s].name);
    } else if (b.sensors[*again].mount != a.sensors[s].mount) {
      result.not_compared.push_back(a.sensors[s].name +
                                    " is on the probe in one rig and fixed to the world in the other");
    } else {
      matches.push_back({s, *again});
    }
  }
  for (const Sensor& sensor : b.sensors) {
    if (!a.find(sensor.name)) result.only_b.push_back(sensor.name);
  }
  return matches;
}

void match_leds(const Rig& a, const Rig& b, RigDifference& result) {
  const auto has = [](const Rig& rig, const std::string& name) {
    return std::any_of(rig.leds.begin(), rig.leds.end(), [&](const Led& led) { return led.name == name; });
  };
  for (const Led& led : a.leds) {
    if (!has(b, led.name)) result.only_a.push_back(led.name);
  }
  for (const Led& led : b.leds) {
    if (!has(a, led.name)) result.only_b.push_back(led.name);
  }
}

bool one_lens(const Rig& rig, std::size_t s, std::size_t t) {
  return rig.sensors[s].lens_of.value_or(s) == rig.sensors[t].lens_of.value_or(t);
}

// Of one mount, but for one sensor at two places.
std::vector<std::pair<Match, Match>> pairs_of(const Rig& a, const std::vector<Match>& matches) {
  std::vector<std::pair<Match, Match>> pairs;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    for (std::size_t j = i + 1; j < matches.size(); ++j) {
      const bool together = a.sensors[matches[i].a].mount == a.sensors[matches[j].a].mount;
      if (together && !one_lens(a, matches[i].a, matches[j].a)) pairs.emplace_back(matches[i], matches[j]);
    }
  }
  return pairs;
}

// The middle of the volume that a sensor measures with a partner; infinite where nothing tells it.
double working_distance_mm(const Rig& a, std::size_t sensor, const std::vector<std::pair<Match, Match>>& pairs,
                           const RigDifferenceOptions& options) {
  if (options.depth) return 0.5 * (options.depth->near_mm + options.depth->far_mm);
  for (const auto& [first, second] : pairs) {
    if (first.a != sensor && second.a != sensor) continue;
    const auto depth = common_depth(a.sensors[sensor], a.sensors[first.a == sensor ? second.a : first.a]);
    if (depth) return 0.5 * (depth->near_mm + depth->far_mm);
  }
  return kInfinite_mm;
}

std::vector<ParameterDrift> parameter_drift(const Rig& a, const Rig& b, const Match& match) {
  const Lens &lens_a = a.sensors[match.a].lens, &lens_b = b.sensors[match.b].lens;
  if (lens_a.model() != lens_b.model()) return {};
  const std::vector<std::string> names = lens_row_names(a, match.a);
  const Eigen::VectorXd variance = covariance_of(a.covariance, names).diagonal() +
                                   covariance_of(b.covariance, lens_row_names(b, match.b)).diagonal();
  std::vector<ParameterDrift> drift;
  for (std::size_t i = 0; i < names.size(); ++i) {
    drift.push_back(
        {names[i], lens_b.parameters()[i] - lens_a.parameters()[i], std::sqrt(variance[static_cast<Eigen::Index>(i)])});
  }
  return drift;
}

void compare_sensors(const Rig& a, const Rig& b, const std::vector<Match>& matches,
                     const std::vector<std::pair<Match, Match>>& pairs, const RigDifferenceOptions& options,
                     RigDifference& result) {
  for (const Match& match : matches) {
    const ProjectionGrid grid{options.columns, options.rows, working_distance_mm(a, match.a, pairs, options),
                              options.no_difference_px};
    auto projection = projection_difference(a, match.a, b, match.b, grid);
    if (!projection) {
      result.not_compared.push_back(projection.error().message);
      continue;
    }
    const Lens &lens_a = a.sensors[match.a].lens, &lens_b = b.sensors[match.b].lens;
    result.sensors.push_back({a.sensors[match.a].name, lens_a.size(), lens_a.model(), lens_b.model(), grid.distance_mm,
                              std::move(*projection), parameter_drift(a, b, match)});
  }
}

void compare_pairs(const Rig& a, const Rig& b, const std::vector<std::pair<Match, Match>>& pairs,
                   const RigDifferenceOptions& options, RigDifference& result) {
  for (const auto& [first, second] : pairs) {
    const Sensor &first_a = a.sensors[first.a], &second_a = a.sensors[second.a];
    const auto depth = options.depth ? options.depth : common_depth(first_a, second_a);
    if (!depth) {
      result.not_compared.push_back(fmt::format(
          "{} and {}: their axes do not meet, and nothing else says where they measure", first_a.name, second_a.name));
      result.depth_unknown = true;
      continue;
    }
    auto volume = volume_difference(a, b, {first.a, second.a, first.b, second.b}, *depth, options.no_difference_mm);
    if (!volume) {
      result.not_compared.push_back(volume.error().message);
      continue;
    }
    const Pose in_a = second_a.sensor_from_mount * first_a.sensor_from_mount.inverse();
    const Pose in_b = b.sensors[second.b].sensor_from_mount * b.sensors[first.b].sensor_from_mount.inverse();
    const Vector6d step = local_step(in_a, in_b);
    result.pairs.push_back(
        {first_a.name, second_a.name, *depth, std::move(*volume), step.head<3>().norm(), step.tail<3>().norm()});
  }
}

void compare_leds(const Rig& a, const Rig& b, const RigDifferenceOptions& options, RigDifference& result) {
  std::optional<MatchedPair> pair;
  LedDrift drift;
  VolumeDepth depth;
  for (const PairDrift& on_probe : result.pairs) {
    const std::size_t first = *a.find(on_probe.first), second = *a.find(on_probe.second);
    if (a.sensors[first].mount != Mount::probe) continue;
    pair = MatchedPair{first, second, *b.find(on_probe.first), *b.find(on_probe.second)};
    depth = on_probe.depth;
    drift.first = on_probe.first;
    drift.second = on_probe.second;
    break;
  }
  auto leds = led_difference(a, b, pair, depth, options.no_difference_mm);
  if (!leds) return;
  drift.leds = std::move(*leds);
  result.leds = std::move(drift);
}

// Where nothing is uncertain any difference counts.
bool is_significant(const AlignedDifference& difference, double probability) {
  if (difference.degrees == 0) return difference.rms() > difference.floor;
  return difference.probability < probability;
}

void judge(RigDifference& result) {
  const bool carried = result.leds && result.leds->leds.of_measured;
  result.tests =
      static_cast<int>(result.sensors.size() + result.pairs.size()) + (result.leds ? 1 : 0) + (carried ? 1 : 0);
  const double probability = outside_probability(result.k) / std::max(1, result.tests);
  for (SensorDrift& sensor : result.sensors) sensor.significant = is_significant(sensor.projection.px, probability);
  for (PairDrift& pair : result.pairs) pair.significant = is_significant(pair.volume.mm, probability);
  if (!result.leds) return;
  result.leds->shape_significant = is_significant(result.leds->leds.mm, probability);
  if (carried) result.leds->carried_significant = is_significant(result.leds->leds.of_measured->mm, probability);
}

// The sensors that every significant pair of a mount has in common, where
// another pair without them agrees.
std::set<std::string> movers(const std::vector<PairDrift>& pairs) {
  std::set<std::string> common, agreeing;
  bool any = false;
  for (const PairDrift& pair : pairs) {
    if (!pair.significant) {
      agreeing.insert({pair.first, pair.second});
      continue;
    }
    std::set<std::string> kept;
    for (const std::string& name : {pair.first, pair.second}) {
      if (!any || common.contains(name)) kept.insert(name);
    }
    common = std::move(kept);
    any = true;
  }
  for (const std::string& name : agreeing) common.erase(name);
  return agreeing.empty() ? std::set<std::string>{} : common;
}

void name_changes(RigDifference& result) {
  std::set<std::string> lenses;
  for (const SensorDrift& sensor : result.sensors) {
    if (!sensor.significant) continue;
    lenses.insert(sensor.sensor);
    result.changed.push_back(fmt::format("the lens of {} images otherwise", sensor.sensor));
  }
  const std::set<std::string> moved = movers(result.pairs);
  for (const std::string& name : moved) {
    if (!lenses.contains(name)) result.changed.push_back(name + " has moved against the other sensors");
  }
  for (const PairDrift& pair : result.pairs) {
    const bool told = moved.contains(pair.first) || moved.contains(pair.second) || lenses.contains(pair.first) ||
                      lenses.contains(pair.second);
    if (pair.significant && !told) {
      result.changed.push_back(fmt::format("{} has moved against {}", pair.second, pair.first));
    }
  }
  if (!result.leds) return;
  if (result.leds->shape_significant) result.changed.emplace_back("the LEDs have moved among each other");
  if (result.leds->carried_significant && result.changed.empty()) {
    result.changed.push_back(
        fmt::format("the LEDs have moved against {} and {}", result.leds->first, result.leds->second));
  }
}

}  // namespace

Expected<RigDifference> rig_difference(const Rig& a, const Rig& b, const RigDifferenceOptions& options) {
  for (const Rig* rig : {&a, &b}) {
    if (!rig->covariance.names.empty()) continue;
    return fail(
        fmt::format("the {} rig has no covariance, so nothing says "
                    "what a difference means: calibrate it anew",
                    rig == &a ? "first" : "second"));
  }
  RigDifference result;
  result.k = options.k;
  const std::vector<Match> matches = match_sensors(a, b, result);
  match_leds(a, b, result);
  const auto pairs = pairs_of(a, matches);
  compare_sensors(a, b, matches, pairs, options, result);
  compare_pairs(a, b, pairs, options, result);
  compare_leds(a, b, options, result);
  judge(result);
  if (result.tests == 0) {
    return fail("the rigs have no sensors or LEDs in common that can be compared" +
                (result.not_compared.empty() ? std::string() : ": " + result.not_compared.front()));
  }
  name_changes(result);
  return result;
}

}  // namespace crumple
