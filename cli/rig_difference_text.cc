#include "cli/rig_difference_text.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace crumple {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

// The point that differs most for what is known of it.
int worst_point(const AlignedDifference& difference) {
  int worst = 0;
  for (int p = 1; p < difference.points(); ++p) {
    if (difference.sigmas(p) > difference.sigmas(worst)) worst = p;
  }
  return worst;
}

std::string test_line(const std::string& what, const AlignedDifference& d, const std::string& where, bool significant) {
  const int worst = worst_point(d);
  const std::string unexplained =
      d.unexplained > 10 * d.floor ? fmt::format("; {:.4f} that neither covariance can explain", d.unexplained) : "";
  return fmt::format("  {:<28} {:>9.4f} {:>9.4f} {:>9.4f} {:>7.1f}  {:<24} {:>8.2g}{}{}\n", what, d.rms(),
                     d.expected_rms(), d.length(worst), d.sigmas(worst), where, d.probability,
                     significant ? "  significant" : "", unexplained);
}

std::string test_heading(const std::string& title, const std::string& unit) {
  return fmt::format("{:<30} {:>9} {:>9} {:>9} {:>7}  {:<24} {:>8}\n", title, "RMS, " + unit, "expected", "clearest",
                     "sigmas", "where", "p");
}

std::string distance_text(double distance_mm) {
  return std::isinf(distance_mm) ? "at infinity" : fmt::format("at {:.0f} mm", distance_mm);
}

std::string pixel_of(const SensorDrift& sensor) {
  const Eigen::Vector2d& pixel = sensor.projection.pixels[static_cast<std::size_t>(worst_point(sensor.projection.px))];
  return fmt::format("({:.0f}, {:.0f})", pixel.x(), pixel.y());
}

std::string place_in(const VolumeDifference& volume) {
  const Eigen::Vector3d& point = volume.points_mm[static_cast<std::size_t>(worst_point(volume.mm))];
  return fmt::format("({:.0f}, {:.0f}, {:.0f})", point.x(), point.y(), point.z());
}

std::string leds_text(const LedDrift& drift) {
  std::string text =
      test_line("LEDs, among each other", drift.leds.mm,
                drift.leds.leds[static_cast<std::size_t>(worst_point(drift.leds.mm))], drift.shape_significant);
  if (!drift.leds.of_measured) return text;
  return text + test_line("LEDs against " + drift.first + " " + drift.second, drift.leds.of_measured->mm,
                          place_in(*drift.leds.of_measured), drift.carried_significant);
}

// Lens parameters beyond k sigma; with many of them a few always are.
std::string parameters_text(const SensorDrift& sensor, double k) {
  std::string text;
  for (const ParameterDrift& parameter : sensor.parameters) {
    if (!(std::abs(parameter.change) > k * parameter.sigma)) continue;
    const std::string sigmas =
        parameter.sigma > 0 ? fmt::format("{:.1f} sigma", std::abs(parameter.change) / parameter.sigma) : "held";
    text += fmt::format("  {} {:+.4g} ({})\n", parameter.name, parameter.change, sigmas);
  }
  return text;
}

nlohmann::json difference_json(const AlignedDifference& d, const std::string& unit, bool significant) {
  const int worst = worst_point(d);
  return {{"rms_" + unit, d.rms()},
          {"expected_rms_" + unit, d.expected_rms()},
          {"unexplained_rms_" + unit, d.unexplained},
          {"worst_" + unit, d.length(worst)},
          {"worst_sigmas", d.sigmas(worst)},
          {"statistic", d.statistic},
          {"degrees", d.degrees},
          {"probability", d.probability},
          {"significant", significant}};
}

nlohmann::json numbers(const Eigen::VectorXd& vector) { return std::vector<double>(vector.begin(), vector.end()); }

nlohmann::json sensor_drift_json(const SensorDrift& sensor) {
  nlohmann::json document = difference_json(sensor.projection.px, "px", sensor.significant);
  document["sensor"] = sensor.sensor;
  document["lens_models"] = {sensor.model_a, sensor.model_b};
  if (!std::isinf(sensor.distance_mm)) document["distance_mm"] = sensor.distance_mm;
  document["worst_pixel"] =
      numbers(sensor.projection.pixels[static_cast<std::size_t>(worst_point(sensor.projection.px))]);
  document["parameters"] = nlohmann::json::array();
  for (const ParameterDrift& parameter : sensor.parameters) {
    document["parameters"].push_back(
        {{"name", parameter.name}, {"change", parameter.change}, {"sigma", parameter.sigma}});
  }
  return document;
}

nlohmann::json volume_json(const VolumeDifference& volume, bool significant) {
  nlohmann::json document = difference_json(volume.mm, "mm", significant);
  document["worst_point_mm"] = numbers(volume.points_mm[static_cast<std::size_t>(worst_point(volume.mm))]);
  return document;
}

}  // namespace

std::string rig_difference_text(const RigDifference& difference) {
  std::string text;
  if (!difference.sensors.empty()) text += test_heading("projection", "px");
  for (const SensorDrift& sensor : difference.sensors) {
    text += test_line(sensor.sensor + ", " + distance_text(sensor.distance_mm), sensor.projection.px, pixel_of(sensor),
                      sensor.significant);
  }
  if (!difference.pairs.empty() || difference.leds) text += test_heading("measured points", "mm");
  for (const PairDrift& pair : difference.pairs) {
    const std::string what =
        fmt::format("{} {}, {:.0f} to {:.0f}", pair.first, pair.second, pair.depth.near_mm, pair.depth.far_mm);
    text += test_line(what, pair.volume.mm, place_in(pair.volume), pair.significant);
  }
  if (difference.leds) text += leds_text(*difference.leds);
  std::string parameters;
  for (const SensorDrift& sensor : difference.sensors) parameters += parameters_text(sensor, difference.k);
  if (!parameters.empty())
    text += fmt::format("parameters that differ by more than {:g} sigma\n{}", difference.k, parameters);
  if (!difference.only_a.empty())
    text += fmt::format("only in the first rig: {}\n", fmt::join(difference.only_a, ", "));
  if (!difference.only_b.empty())
    text += fmt::format("only in the second rig: {}\n", fmt::join(difference.only_b, ", "));
  for (const std::string& sentence : difference.not_compared) text += fmt::format("not compared: {}.\n", sentence);
  if (difference.depth_unknown) text += "say with --near_mm and --far_mm where pairs measure\n";
  if (!difference.significant()) {
    return text + fmt::format(
                      "no difference beyond both uncertainties, at k = "
                      "{:g} over {} tests\n",
                      difference.k, difference.tests);
  }
  for (const std::string& sentence : difference.changed) text += fmt::format("changed: {}.\n", sentence);
  return text + fmt::format("significant at k = {:g} over {} tests\n", difference.k, difference.tests);
}

nlohmann::json rig_difference_json(const RigDifference& difference) {
  nlohmann::json json{{"k", difference.k},
                      {"tests", difference.tests},
                      {"significant", difference.significant()},
                      {"changed", difference.changed},
                      {"only_in_first", difference.only_a},
                      {"only_in_second", difference.only_b},
                      {"not_compared", difference.not_compared},
                      {"sensors", nlohmann::json::array()},
                      {"pairs", nlohmann::json::array()}};
  for (const SensorDrift& sensor : difference.sensors) json["sensors"].push_back(sensor_drift_json(sensor));
  for (const PairDrift& pair : difference.pairs) {
    nlohmann::json entry = volume_json(pair.volume, pair.significant);
    entry["sensors"] = {pair.first, pair.second};
    entry["depth_mm"] = {pair.depth.near_mm, pair.depth.far_mm};
    entry["turned_deg"] = kDegrees * pair.turned_rad;
    entry["shifted_mm"] = pair.shifted_mm;
    json["pairs"].push_back(std::move(entry));
  }
  if (!difference.leds) return json;
  const LedDrift& leds = *difference.leds;
  json["leds"] = {{"shape", difference_json(leds.leds.mm, "mm", leds.shape_significant)}};
  json["leds"]["shape"]["worst_led"] = leds.leds.leds[static_cast<std::size_t>(worst_point(leds.leds.mm))];
  if (leds.leds.of_measured) {
    json["leds"]["carried"] = volume_json(*leds.leds.of_measured, leds.carried_significant);
    json["leds"]["carried"]["sensors"] = {leds.first, leds.second};
  }
  return json;
}

}  // namespace crumple
