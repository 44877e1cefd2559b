#include "cli/measurement.h"

#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/feature_points.h"
#include "datasets/cloud_file.h"
#include "datasets/stations_file.h"

namespace crumple {
namespace {

using nlohmann::json;
using Kind = PlannedFeature::Kind;

constexpr double kPerDegree = std::numbers::pi / 180;
constexpr double kPerMrad = 1e-3;
constexpr const char* kKindNames[] = {"point", "plane", "sphere"};

constexpr const char* kBudgetHeading = "        u  U (k=2)   u by    scale calibration  station decoding";

// A part that lacks something is the least that it can be.
std::string scale_column(double sigma, const MeasuredCloud& cloud) {
  if (!cloud.scale_known()) return "unknown";
  return fmt::format("{}{:.4f}", cloud.scale_lacks().empty() ? "" : ">=", sigma);
}

std::string budget_columns(const Budget& b, const MeasuredCloud& cloud, double unit) {
  const auto root = [&](double variance) { return std::sqrt(variance) / unit; };
  return fmt::format("{:9.4f}{:9.4f}       {:>9}{:12.4f}{:9.4f}{:9.4f}", root(b.sum()), 2 * root(b.sum()),
                     scale_column(root(b.scale), cloud), root(b.calibration), root(b.station), root(b.decoding));
}

Expected<std::vector<std::size_t>> points_for(const Cloud& cloud, const PlannedFeature& feature) {
  if (feature.kind == Kind::sphere) return points_on_sphere(cloud, feature.near_mm, feature.radius_mm);
  auto points =
      feature.box_mm ? points_within(cloud, *feature.box_mm) : points_within(cloud, feature.near_mm, feature.radius_mm);
  if (!points.empty()) return points;
  return fail("no point of the cloud lies there; coordinates are in the cloud's frame, mm");
}

Expected<MeasuredFeature> measure_feature(const KnownCloud& known, const PlannedFeature& feature) {
  const auto points = points_for(known.cloud, feature);
  if (!points) return tl::unexpected(points.error());
  switch (feature.kind) {
    case Kind::plane:
      return measure_plane(known, *points);
    case Kind::sphere:
      return measure_sphere(known, *points);
    case Kind::point:
      break;
  }
  return measure_point(known, *points);
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

json feature_json(const MeasuredCloud& cloud, const PlannedFeature& planned, const MeasuredFeature& feature) {
  const bool scale_known = cloud.scale_known();
  json result{{"name", planned.name}, {"kind", kKindNames[static_cast<int>(planned.kind)]}};
  result["stations"] = cloud.stations_of(feature);
  for (int axis = 0; axis < 3; ++axis) {
    const std::string key = std::string(planned.kind == Kind::sphere ? "centre" : "position") + "_mm";
    result[key].push_back(quantity_json(value_of(cloud.uncertainty(), feature, axis), scale_known));
  }
  if (planned.kind == Kind::point) return result;
  result["points"] = feature.residuals_mm.size();
  result["rms_mm"] = rms(feature.residuals_mm);
  result["predicted_rms_mm"] = rms(feature.residual_sigmas_mm);
  result["decoding_inflation"] = feature.inflation;
  if (planned.kind == Kind::plane) {
    result["normal"] = {feature.normal().x(), feature.normal().y(), feature.normal().z()};
    for (const NormalTilt& tilt : normal_tilts(cloud.uncertainty(), feature)) {
      json entry = quantity_json(tilt.tilt, scale_known, kPerMrad);
      entry.erase("value");
      entry["about"] = {tilt.about.x(), tilt.about.y(), tilt.about.z()};
      result["normal_tilts_mrad"].push_back(std::move(entry));
    }
  } else {
    result["diameter_mm"] = quantity_json(value_of(cloud.uncertainty(), feature, 3, 2), scale_known);
    result["cap_deg"] = feature.cap_rad / kPerDegree;
  }
  return result;
}

std::string features_text(const MeasuredCloud& cloud, const std::vector<PlannedFeature>& planned,
                          const std::vector<MeasuredFeature>& measured) {
  std::string text = fmt::format("{:<25}{:>12}{:>12}{:>12}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "positions (mm), U: k=2",
                                 "x", "y", "z", "u(x)", "u(y)", "u(z)", "U(x)", "U(y)", "U(z)");
  std::string fits;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const MeasuredFeature& feature = measured[i];
    text += fmt::format("  {:<23}", planned[i].name);
    for (int axis = 0; axis < 3; ++axis) text += fmt::format("{:12.4f}", feature.values[axis]);
    for (const int k : {1, 2}) {
      for (int axis = 0; axis < 3; ++axis) {
        text += fmt::format("{:9.4f}", k * value_of(cloud.uncertainty(), feature, axis).budget.sigma());
      }
    }
    text += "\n";
    if (planned[i].kind == Kind::point) continue;
    fits += fmt::format("  {:<23} {} points of {} stations, residuals {:.4f} mm RMS, predicted {:.4f}", planned[i].name,
                        feature.residuals_mm.size(), cloud.stations_of(feature), rms(feature.residuals_mm),
                        rms(feature.residual_sigmas_mm));
    if (planned[i].kind == Kind::sphere) fits += fmt::format(", a cap of {:.0f} deg", feature.cap_rad / kPerDegree);
    fits += "\n";
  }
  return text + (fits.empty() ? "" : "fits\n" + fits);
}

// Normals, and how far they may be tilted.
std::string normals_text(const MeasuredCloud& cloud, const std::vector<PlannedFeature>& planned,
                         const std::vector<MeasuredFeature>& measured) {
  std::string normals, tilts;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    if (planned[i].kind != Kind::plane) continue;
    const auto line = [&](const Eigen::Vector3d& x) {
      return fmt::format("  {:<23}{:12.6f}{:12.6f}{:12.6f}", planned[i].name, x.x(), x.y(), x.z());
    };
    normals += line(measured[i].normal()) + "\n";
    for (const NormalTilt& tilt : normal_tilts(cloud.uncertainty(), measured[i])) {
      tilts += line(tilt.about) + budget_columns(tilt.tilt.budget, cloud, kPerMrad) + "\n";
    }
  }
  if (normals.empty()) return "";
  const auto heading = [](const char* title) { return fmt::format("{:<25}{:>12}{:>12}{:>12}", title, "x", "y", "z"); };
  return heading("normals") + "\n" + normals + heading("tilts (mrad) about") + kBudgetHeading + "\n" + tilts;
}

Expected<MeasuredQuantity> planned_distance(const MeasuredCloud& cloud, const MeasuredFeature& a,
                                            const MeasuredFeature& b) {
  if (b.kind == MeasuredFeature::Kind::plane) return distance_from_plane(cloud.uncertainty(), a, b);
  return distance(cloud.uncertainty(), a, b);
}

Expected<MeasuredQuantity> planned_angle(const MeasuredCloud& cloud, const std::vector<MeasuredFeature>& measured,
                                         const std::vector<std::size_t>& of) {
  if (of.size() == 2) return angle(cloud.uncertainty(), measured[of[0]], measured[of[1]]);
  return angle(cloud.uncertainty(), measured[of[0]], measured[of[1]], measured[of[2]]);
}

std::string names_of(const std::vector<PlannedFeature>& features, const std::vector<std::size_t>& of) {
  std::string names;
  for (const std::size_t i : of) names += (names.empty() ? "" : " - ") + features[i].name;
  return names;
}

// Distances or angles, as a list of the document and a table.
Expected<void> add_quantities(const MeasuredCloud& cloud, const MeasuringPlan& plan,
                              const std::vector<MeasuredFeature>& measured, bool angles, MeasurementReport& report) {
  const auto& wanted = angles ? plan.angles : plan.distances;
  if (wanted.empty()) return {};
  const double unit = angles ? kPerDegree : 1;
  json& list = report.document[angles ? "angles_deg" : "distances_mm"];
  report.text += quantity_heading(angles ? "angles (deg)" : "distances (mm)");
  for (const std::vector<std::size_t>& of : wanted) {
    const std::string name = names_of(plan.features, of);
    const auto found =
        angles ? planned_angle(cloud, measured, of) : planned_distance(cloud, measured[of[0]], measured[of[1]]);
    if (!found) return fail(fmt::format("{}: {}", name, found.error().message));
    json entry = quantity_json(*found, cloud.scale_known(), unit);
    for (const std::size_t i : of) entry["of"].push_back(plan.features[i].name);
    list.push_back(std::move(entry));
    report.text += quantity_line(name, *found, cloud, unit);
  }
  return {};
}

}  // namespace

Expected<MeasuredCloud> MeasuredCloud::read(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "stations.yaml")) {
    return fail(
        fmt::format("{} holds no stations.yaml, so nothing says how sure its points are: give the folder that `crumple "
                    "reconstruct` wrote; where that could not tell, its summary.json says why (uncertainty.lacks)",
                    folder.string()));
  }
  const auto known = read_stations(folder);
  if (!known) return tl::unexpected(known.error());
  auto cloud = read_cloud(folder / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  if (cloud->frame != "world" && known->poses.stations.size() > 1) {
    return fail(fmt::format("{}: its stations are in no common frame, so nothing can be measured between them",
                            folder.string()));
  }
  for (const CloudPoint& point : cloud->points) {
    if (point.view >= known->poses.views.size()) {
      return fail(
          fmt::format("{}: a point is of view {}, which stations.yaml does not have", folder.string(), point.view));
    }
  }
  for (const CloudShare& share : cloud->shares) {
    if (share.view >= known->poses.views.size()) {
      return fail(
          fmt::format("{}: a point is of view {}, which stations.yaml does not have", folder.string(), share.view));
    }
  }
  auto uncertainty = PointUncertainty::create(known->rig, known->poses);
  if (!uncertainty) return fail(fmt::format("{}: {}", folder.string(), uncertainty.error().message));
  MeasuredCloud result;
  result.cloud_ = std::make_unique<Cloud>(std::move(*cloud));
  result.uncertainty_ = std::make_unique<PointUncertainty>(std::move(*uncertainty));
  if (result.scale_known()) result.scale_lacks_ = known->rig.scale_lacks;
  result.rig_ = known->rig;
  return result;
}

std::size_t MeasuredCloud::stations_of(const MeasuredFeature& feature) const {
  std::size_t count = 0;
  for (Eigen::Index s = 0; 6 * s < feature.by_pose.cols(); ++s) {
    count += !feature.by_pose.middleCols<6>(6 * s).isZero(0);
  }
  return count;
}

Expected<std::vector<MeasuredFeature>> MeasuredCloud::measure(const std::vector<PlannedFeature>& features) const {
  const KnownCloud known(*cloud_, *uncertainty_);
  std::vector<MeasuredFeature> measured;
  for (const PlannedFeature& feature : features) {
    auto found = measure_feature(known, feature);
    if (!found) {
      return fail(
          fmt::format("{} {}: {}", kKindNames[static_cast<int>(feature.kind)], feature.name, found.error().message));
    }
    measured.push_back(std::move(*found));
  }
  return measured;
}

Expected<MeasurementReport> measurement_report(const MeasuredCloud& cloud, const MeasuringPlan& plan) {
  const auto measured = cloud.measure(plan.features);
  if (!measured) return tl::unexpected(measured.error());
  MeasurementReport report;
  report.document = {{"schema", "crumple-measurement/1"}, {"frame", cloud.cloud().frame}, {"features", json::array()}};
  add_scale(cloud, report.document);
  for (std::size_t i = 0; i < measured->size(); ++i) {
    report.document["features"].push_back(feature_json(cloud, plan.features[i], (*measured)[i]));
  }
  report.text = features_text(cloud, plan.features, *measured) + normals_text(cloud, plan.features, *measured);
  std::string diameters;
  for (std::size_t i = 0; i < measured->size(); ++i) {
    if (plan.features[i].kind != Kind::sphere) continue;
    diameters += quantity_line(plan.features[i].name, value_of(cloud.uncertainty(), (*measured)[i], 3, 2), cloud);
  }
  if (!diameters.empty()) report.text += quantity_heading("diameters (mm)") + diameters;
  for (const bool angles : {false, true}) {
    if (auto done = add_quantities(cloud, plan, *measured, angles, report); !done) return tl::unexpected(done.error());
  }
  report.text += scale_sentence(cloud);
  return report;
}

json quantity_json(const MeasuredQuantity& quantity, bool scale_known, double unit) {
  const Budget& budget = quantity.budget;
  json result{{"value", quantity.value / unit},
              {"u", budget.sigma() / unit},
              {"U", 2 * budget.sigma() / unit},
              {"k", 2},
              {"budget",
               {{"scale", nullptr},
                {"calibration", std::sqrt(budget.calibration) / unit},
                {"station", std::sqrt(budget.station) / unit},
                {"decoding", std::sqrt(budget.decoding) / unit}}}};
  if (scale_known) result["budget"]["scale"] = std::sqrt(budget.scale) / unit;
  if (budget.other > 0) result["budget"]["certificate"] = std::sqrt(budget.other) / unit;
  return result;
}

std::string quantity_heading(const std::string& title) {
  return fmt::format("{:<24}{:>12}{}\n", title, "value", kBudgetHeading);
}

std::string quantity_line(const std::string& name, const MeasuredQuantity& quantity, const MeasuredCloud& cloud,
                          double unit) {
  return fmt::format("  {:<22}{:12.4f}{}\n", name, quantity.value / unit, budget_columns(quantity.budget, cloud, unit));
}

void add_scale(const MeasuredCloud& cloud, json& document) {
  document["scale_known"] = cloud.scale_known();
  if (!cloud.scale_lacks().empty()) document["scale_lacks"] = cloud.scale_lacks();
}

std::string scale_sentence(const MeasuredCloud& cloud) {
  if (!cloud.scale_known()) {
    return "scale uncertainty unknown: no board had a certificate when the rig was calibrated and there was no scale "
           "bar; no U above contains it\n";
  }
  if (cloud.scale_lacks().empty()) return "";
  return fmt::format("scale uncertainty incomplete: {}; no U above contains what is missing\n",
                     fmt::join(cloud.scale_lacks(), "; "));
}

}  // namespace crumple
