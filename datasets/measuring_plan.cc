#include "datasets/measuring_plan.h"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "datasets/limits.h"
#include "datasets/nearest_name.h"
#include "datasets/output_folder.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

using FeatureKind = PlannedFeature::Kind;

constexpr const char* kMeasureSchema = "crumple-measure/1";
constexpr const char* kAcceptanceSchema = "crumple-vdi2634/1";
constexpr double kLargestRadius_mm = 1e5;

Eigen::Vector3d read_coordinates(const YamlValue& value) {
  return read_vector<3>(value, -kLargestValue, kLargestValue);
}

Eigen::AlignedBox3d read_search_box(const YamlValue& value) {
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero().eval());
  YamlMap map = value.map();
  if (const auto from = map.require("from", "[x, y, z]")) box.min() = read_coordinates(*from);
  if (const auto to = map.require("to", "[x, y, z]")) box.max() = read_coordinates(*to);
  if ((box.min().array() > box.max().array()).any()) value.problem("runs backwards: `from` has the smaller numbers");
  map.finish();
  return box;
}

void read_place_of(YamlMap& map, PlannedFeature& feature) {
  if (feature.kind == FeatureKind::plane) {
    if (const auto box = map.find("box_mm")) {
      feature.box_mm = read_search_box(*box);
      return;
    }
  }
  if (const auto near = map.require("near_mm", "[x, y, z] in the cloud's frame"))
    feature.near_mm = read_coordinates(*near);
}

void read_ball_of(YamlMap& map, PlannedFeature& feature) {
  read_place_of(map, feature);
  if (feature.box_mm) return;
  feature.radius_mm = required_number(map, "radius_mm", "how far its points are from there", 1e-3, kLargestRadius_mm);
}

// A map from name to feature.
void read_planned(YamlMap& map, const std::string& key, FeatureKind kind, std::vector<PlannedFeature>& features,
                  const std::function<void(YamlMap&, PlannedFeature&)>& read) {
  const auto list = map.find(key);
  if (!list) return;
  YamlMap named = list->map();
  for (const auto& [name, value] : named.entries()) {
    const bool taken =
        std::any_of(features.begin(), features.end(), [&, &n = name](const PlannedFeature& f) { return f.name == n; });
    if (taken) value.problem("has the name of another feature");
    PlannedFeature feature{name, kind, {0, 0, 0}, 0, {}};
    YamlMap keys = value.map();
    read(keys, feature);
    keys.finish();
    features.push_back(std::move(feature));
  }
  named.finish();
}

std::size_t feature_named(const YamlValue& value, const std::vector<PlannedFeature>& features) {
  const std::string name = value.text();
  std::vector<std::string> names;
  for (const PlannedFeature& feature : features) names.push_back(feature.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  const std::string near = nearest_name(name, names);
  value.problem(fmt::format("{} is no feature of this file{}", name, near.empty() ? "" : "; is it " + near + "?"));
  return features.size();
}

std::vector<std::size_t> read_names(const YamlValue& value, const std::vector<PlannedFeature>& features) {
  std::vector<std::size_t> indices;
  for (const YamlValue& name : value.list()) indices.push_back(feature_named(name, features));
  std::vector<std::size_t> sorted = indices;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) value.problem("names a feature twice");
  return indices;
}

std::size_t count_of(const std::vector<std::size_t>& indices, FeatureKind kind,
                     const std::vector<PlannedFeature>& features) {
  return static_cast<std::size_t>(std::count_if(
      indices.begin(), indices.end(), [&](std::size_t i) { return i < features.size() && features[i].kind == kind; }));
}

void read_distances(YamlMap& map, MeasuringPlan& plan) {
  const auto list = map.find("distances");
  if (!list) return;
  for (const YamlValue& value : list->list()) {
    std::vector<std::size_t> pair = read_names(value, plan.features);
    if (pair.size() != 2 || count_of(pair, FeatureKind::plane, plan.features) > 1) {
      value.problem("must name two features, of which one at most is a plane");
    } else if (pair.front() < plan.features.size() && plan.features[pair.front()].kind == FeatureKind::plane) {
      std::swap(pair.front(), pair.back());
    }
    plan.distances.push_back(std::move(pair));
  }
}

void read_angles(YamlMap& map, MeasuringPlan& plan) {
  const auto list = map.find("angles");
  if (!list) return;
  for (const YamlValue& value : list->list()) {
    std::vector<std::size_t> named = read_names(value, plan.features);
    const std::size_t planes = count_of(named, FeatureKind::plane, plan.features);
    if (!(named.size() == 2 && planes == 2) && !(named.size() == 3 && planes == 0)) {
      value.problem("must name two planes, or three points or spheres");
    }
    plan.angles.push_back(std::move(named));
  }
}

CertifiedLength read_certified(YamlMap& map, const std::string& what) {
  return {required_number(map, what + "_mm", "by its certificate", 1e-3, kLargestRadius_mm),
          required_number(map, what + "_sigma_mm", "its standard uncertainty by the certificate", 0, 1)};
}

void read_bars(YamlMap& map, AcceptancePlan& plan) {
  const auto list = map.find("ball_bars");
  if (!list) return;
  YamlMap named = list->map();
  for (const auto& [name, value] : named.entries()) {
    BallBar bar{name, 0, 0, {}};
    YamlMap keys = value.map();
    if (const auto spheres = keys.require("spheres", "the names of two spheres")) {
      const std::vector<std::size_t> ends = read_names(*spheres, plan.features);
      if (ends.size() != 2 || count_of(ends, FeatureKind::sphere, plan.features) != 2) {
        spheres->problem("must name two spheres");
      } else {
        bar.from = ends[0];
        bar.to = ends[1];
      }
    }
    bar.length = read_certified(keys, "length");
    keys.finish();
    plan.bars.push_back(bar);
  }
  named.finish();
}

void read_limits(YamlMap& map, AcceptancePlan& plan) {
  const auto limits = map.find("limits_mm");
  if (!limits) return;
  YamlMap keys = limits->map();
  for (const char* const name : {"probing_form", "probing_size", "sphere_spacing", "length", "flatness"}) {
    if (const auto limit = keys.find(name)) plan.limits_mm[name] = limit->positive_number();
  }
  keys.finish();
}

// Reads a file of a schema by `read`.
template <typename Plan>
Expected<Plan> read_plan(const std::filesystem::path& file, const char* schema,
                         const std::function<void(YamlMap&, Plan&)>& read) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto document = parse_yaml(*text, file.string());
  if (!document) return tl::unexpected(document.error());
  YamlProblems problems(file.string());
  YamlMap map(*document, "", &problems);
  if (const auto stated = map.require("schema", schema)) stated->one_of({schema});
  Plan plan;
  read(map, plan);
  if (plan.features.empty()) map.problem("names nothing to measure");
  map.finish();
  if (const auto error = problems.error()) return tl::unexpected(*error);
  return plan;
}

}  // namespace

Expected<MeasuringPlan> read_measuring_plan(const std::filesystem::path& file) {
  return read_plan<MeasuringPlan>(file, kMeasureSchema, [](YamlMap& map, MeasuringPlan& plan) {
    read_planned(map, "points", FeatureKind::point, plan.features, read_ball_of);
    read_planned(map, "planes", FeatureKind::plane, plan.features, read_ball_of);
    read_planned(map, "spheres", FeatureKind::sphere, plan.features, read_ball_of);
    read_distances(map, plan);
    read_angles(map, plan);
  });
}

Expected<AcceptancePlan> read_acceptance_plan(const std::filesystem::path& file) {
  return read_plan<AcceptancePlan>(file, kAcceptanceSchema, [](YamlMap& map, AcceptancePlan& plan) {
    read_planned(map, "spheres", FeatureKind::sphere, plan.features, [&](YamlMap& keys, PlannedFeature& sphere) {
      read_place_of(keys, sphere);
      plan.diameters.push_back(read_certified(keys, "diameter"));
      sphere.radius_mm = plan.diameters.back().length_mm / 2;
    });
    read_planned(map, "plates", FeatureKind::plane, plan.features, read_ball_of);
    read_bars(map, plan);
    read_limits(map, plan);
  });
}

}  // namespace crumple
