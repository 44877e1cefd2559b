#include "cli/calibration_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace crumple {
namespace {

using nlohmann::json;

constexpr double kUsualTrim = 0.01;

std::vector<GroupSummary> groups_of(const BundleResult& bundle, std::size_t sensor) {
  std::vector<GroupSummary> groups;
  for (const GroupSummary& group : bundle.groups) {
    if (group.sensor == sensor) groups.push_back(group);
  }
  return groups;
}

json group_json(const GroupSummary& group) {
  const auto coordinates = static_cast<double>(group.observations - group.outliers) * View::dimension_of(group.kind);
  return {{"rms_px", group.rms_px},
          {"rms_all_px", group.rms_all_px},
          {"sigma_px", group.sigma_px},
          {"sigma_estimated", group.sigma_estimated},
          {"observations", group.observations},
          {"outliers", group.outliers},
          {"redundancy", group.redundancy},
          {"redundancy_share", coordinates > 0 ? json(group.redundancy / coordinates) : json()},
          {"standardised_limit", group.standardised_limit},
          {"gross_error_px", group.gross_error_px ? json(*group.gross_error_px) : json()}};
}

// A sensor's figures over all its kinds of observations; sigma is that of the largest group.
json sensor_json(const Calibration& calibration, std::size_t index) {
  const Sensor& sensor = calibration.bundle.state.rig.sensors[index];
  const Eigen::MatrixXd covariance =
      whole_covariance(calibration).of({{BlockId::Kind::lens, index}}, calibration.bundle.state);
  json result{{"kind", sensor.kind == SensorKind::camera ? "camera" : "projector"},
              {"model", sensor.lens.model()},
              {"parameters", json::object()},
              {"groups", json::object()}};
  const std::vector<std::string> names = lens_parameter_names(sensor.lens.model());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int row = static_cast<int>(i);
    result["parameters"][names[i]] = {{"value", sensor.lens.parameters()[i]},
                                      {"sigma", std::sqrt(covariance(row, row))}};
  }
  double square_sum = 0;
  std::size_t observations = 0, outliers = 0, largest = 0;
  for (const GroupSummary& group : groups_of(calibration.bundle, index)) {
    const std::size_t accepted = group.observations - group.outliers;
    square_sum += group.rms_px * group.rms_px * static_cast<double>(accepted);
    observations += group.observations;
    outliers += group.outliers;
    if (group.observations > largest) result["sigma_px"] = group.sigma_px;
    largest = std::max(largest, group.observations);
    result["groups"][name_of(group.kind)] = group_json(group);
  }
  result["rms_px"] =
      observations > outliers ? std::sqrt(square_sum / static_cast<double>(observations - outliers)) : 0.0;
  result["observations"] = observations;
  result["outliers"] = outliers;
  return result;
}

json board_json(const Calibration& calibration, const Board& board) {
  return {{"warp_estimated", calibration.warp_estimated},
          {"warp_statistic", calibration.warp_statistic},
          {"warp_mm", {board.warp_mm.x(), board.warp_mm.y()}},
          {"scale", board.scale}};
}

json led_json(const Calibration& calibration, std::size_t index) {
  const CalibrationState& state = calibration.bundle.state;
  const Led& led = state.rig.leds[index];
  const Eigen::MatrixXd covariance = whole_covariance(calibration).of({{BlockId::Kind::led, index}}, state);
  const Eigen::Vector3d sigma_mm = covariance.diagonal().cwiseSqrt();
  return {{"mount", led.mount == Mount::probe ? "probe" : "world"},
          {"position_mm", {led.position_mm.x(), led.position_mm.y(), led.position_mm.z()}},
          {"sigma_mm", {sigma_mm.x(), sigma_mm.y(), sigma_mm.z()}}};
}

json views_json(const Calibration& calibration) {
  json views = json::array();
  for (const ViewSummary& view : calibration.bundle.views) {
    views.push_back({{"station", place_name(calibration, view)},
                     {"sensor", calibration.bundle.state.rig.sensors[view.sensor].name},
                     {"kind", name_of(view.kind)},
                     {"rms_px", view.rms_px},
                     {"rms_all_px", view.rms_all_px},
                     {"observations", view.inlier.size()},
                     {"outliers", std::count(view.inlier.begin(), view.inlier.end(), 0)}});
  }
  return views;
}

json priors_json(const Calibration& calibration) {
  json priors = json::array();
  for (const Prior& prior : calibration.priors) {
    json sigmas = json::object();
    const Eigen::VectorXd sigma = prior.sigmas();
    for (std::size_t i = 0; i < prior.terms().size(); ++i) {
      const PriorTerm& term = prior.terms()[i];
      const auto names = parameter_names(term.block, calibration.bundle.state);
      sigmas[names[static_cast<std::size_t>(term.row)]] = sigma[static_cast<Eigen::Index>(i)];
    }
    priors.push_back({{"name", prior.name()}, {"weak", prior.weak()}, {"sigma", sigmas}});
  }
  return priors;
}

json undetermined_json(const BundleResult& bundle) {
  json all = json::array();
  for (const Undetermined& undetermined : bundle.undetermined) {
    all.push_back({{"prior", undetermined.prior},
                   {"prior_share", undetermined.prior_share},
                   {"terms", undetermined.terms},
                   {"trade_places_with", undetermined.partners}});
  }
  return all;
}

json held_out_json(const HeldOutBoard& board) {
  return {{"station", board.station},
          {"points", board.points},
          {"kept_of_white", board.kept_of_white},
          {"dense_plane_rms_mm", board.dense_plane_rms_mm},
          {"dense_plane_rms_untrimmed_mm", board.dense_plane_rms_untrimmed_mm},
          {"trimmed_share", board.trimmed_share},
          {"dense_shape_rms_mm", board.dense_shape_rms_mm},
          {"corner_plane_rms_mm", board.corner_plane_rms_mm},
          {"pitch_rms_mm", board.pitch_rms_mm},
          {"diagonal_error_mm", {board.diagonal_error_mm[0], board.diagonal_error_mm[1]}},
          {"mean_sigma_mm", board.mean_sigma_mm}};
}

}  // namespace

json calibration_summary(const Calibration& calibration, const Verdict& verdict,
                         const std::vector<SkippedView>& skipped) {
  const CalibrationState& state = calibration.bundle.state;
  json summary{{"schema", "crumple-summary/1"},
               {"verdict", level_of(verdict)},
               {"reasons", verdict.reasons},
               {"notes", verdict.notes},
               {"placements", calibration.placement_names.size()},
               {"sensors", json::object()},
               {"views", views_json(calibration)},
               {"skipped", json::array()},
               {"corner_inflation", calibration.inflation.corners},
               {"stripe_inflation", calibration.inflation.stripes},
               {"priors", priors_json(calibration)},
               {"undetermined", undetermined_json(calibration.bundle)},
               {"condition", calibration.bundle.covariance.condition()},
               {"weakest_direction", calibration.bundle.covariance.weakest_direction()}};
  summary["scale_uncertainty"] = calibration.scale
                                     ? json(calibration.scale->relative)
                                     : json("unknown: no board has a certificate, and there is no scale bar");
  if (calibration.scale && !calibration.scale->lacks.empty()) {
    summary["scale_uncertainty_lacks"] = fmt::format("{}", fmt::join(calibration.scale->lacks, "; "));
  }
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    summary["sensors"][state.rig.sensors[s].name] = sensor_json(calibration, s);
  }
  for (const SkippedView& view : skipped) {
    summary["skipped"].push_back(
        {{"station", view.station}, {"sensor", view.sensor}, {"reason", view.reason}, {"by_hand", view.by_hand}});
  }
  for (const Board& board : state.boards) summary["boards"][board.name] = board_json(calibration, board);
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) {
    summary["leds"][state.rig.leds[l].name] = led_json(calibration, l);
  }
  if (!calibration.station_names.empty()) summary["stations"] = calibration.station_names.size();
  return summary;
}

std::string calibration_text(const Calibration& calibration, const Verdict& verdict,
                             const std::vector<SkippedView>& skipped) {
  const BundleResult& bundle = calibration.bundle;
  std::string text = fmt::format("verdict: {}\n", level_of(verdict));
  for (const std::string& reason : verdict.reasons) text += fmt::format("  - {}\n", reason);
  for (const std::string& note : verdict.notes) text += fmt::format("note: {}\n", note);
  text += fmt::format("placements: {}\n", calibration.placement_names.size());
  for (const SkippedView& view : skipped) {
    text += fmt::format("  left out: station {}, {}: {}\n", view.station, view.sensor, view.reason);
  }
  for (std::size_t s = 0; s < bundle.state.rig.sensors.size(); ++s) {
    const Sensor& sensor = bundle.state.rig.sensors[s];
    text += fmt::format("{} ({})\n", sensor.name, sensor.lens.model());
    for (const GroupSummary& group : groups_of(bundle, s)) {
      text += fmt::format("  {:8} {:7} observations, {:4} outliers, RMS {:.4f} px, sigma {:.4f} px{}\n",
                          name_of(group.kind), group.observations, group.outliers, group.rms_px, group.sigma_px,
                          group.sigma_estimated ? "" : " (assumed)");
    }
    const Eigen::MatrixXd covariance = whole_covariance(calibration).of({{BlockId::Kind::lens, s}}, bundle.state);
    const std::vector<std::string> names = lens_parameter_names(sensor.lens.model());
    const std::size_t shown = sensor.lens.splined() ? 4 : names.size();
    for (std::size_t i = 0; i < shown; ++i) {
      const int row = static_cast<int>(i);
      text += fmt::format("  {:3} {:14.6f} +- {:.6f}\n", names[i], sensor.lens.parameters()[i],
                          std::sqrt(covariance(row, row)));
    }
    if (shown < names.size()) text += fmt::format("  and {} control points\n", (names.size() - shown) / 2);
    if (sensor.sensor_from_mount.translation.isZero() && sensor.sensor_from_mount.rotation.vec().isZero()) continue;
    const Eigen::Vector3d t = sensor.sensor_from_mount.translation;
    const Eigen::Vector3d r = rotation_vector(sensor.sensor_from_mount.rotation) * 180 / std::numbers::pi;
    text += fmt::format("  from {}: rotation vector {:.4f} {:.4f} {:.4f} deg, translation {:.3f} {:.3f} {:.3f} mm\n",
                        sensor.mount == Mount::probe ? "probe" : "world", r.x(), r.y(), r.z(), t.x(), t.y(), t.z());
  }
  for (std::size_t l = 0; l < bundle.state.rig.leds.size(); ++l) {
    const Led& led = bundle.state.rig.leds[l];
    const Eigen::MatrixXd covariance = whole_covariance(calibration).of({{BlockId::Kind::led, l}}, bundle.state);
    const Eigen::Vector3d sigma_mm = covariance.diagonal().cwiseSqrt();
    text += fmt::format("LED {}: {:.3f} {:.3f} {:.3f} +- {:.3f} {:.3f} {:.3f} mm in the {}'s frame\n", led.name,
                        led.position_mm.x(), led.position_mm.y(), led.position_mm.z(), sigma_mm.x(), sigma_mm.y(),
                        sigma_mm.z(), led.mount == Mount::probe ? "probe" : "world");
  }
  if (calibration.inflation.corners > 1) {
    text += fmt::format("corners: {:.1f} correlated ones count as one\n", calibration.inflation.corners);
  }
  if (calibration.inflation.stripes > 1) {
    text += fmt::format("stripe readings: {:.1f} correlated ones count as one\n", calibration.inflation.stripes);
  }
  for (const Board& board : bundle.state.boards) {
    text += calibration.warp_estimated ? fmt::format("{} warp: {:.4f} {:.4f} mm (statistic {:.1f})\n", board.name,
                                                     board.warp_mm.x(), board.warp_mm.y(), calibration.warp_statistic)
                                       : fmt::format("{}: taken as flat\n", board.name);
  }
  if (!calibration.scale)
    return text + "scale uncertainty: unknown, no board has a certificate and there is no scale bar\n";
  text += fmt::format("scale: relative uncertainty {:.3g} (k = 1) by certificates", calibration.scale->relative);
  const std::vector<std::string>& lacks = calibration.scale->lacks;
  return text + (lacks.empty() ? "\n" : fmt::format("; it is not complete: {}\n", fmt::join(lacks, "; ")));
}

json cross_validation_summary(const CrossValidation& validation) {
  json summary = held_out_json(validation.mean);
  summary.erase("station");
  summary["diagonal_error_mm"] = validation.mean.diagonal_error_mm[0];
  summary["placements"] = json::array();
  for (const HeldOutBoard& board : validation.boards) summary["placements"].push_back(held_out_json(board));
  return summary;
}

std::string cross_validation_text(const CrossValidation& validation) {
  std::string text =
      "left out  points  of white  dense plane RMS  untrimmed  trimmed  to shape  corner plane  pitch RMS  diagonals "
      "(mm)\n";
  const auto row = [&](const HeldOutBoard& board, const std::string& diagonals) {
    text += fmt::format("{:>8} {:7} {:7.2f} % {:16.3f} {:10.3f} {:6.2f} % {:9.3f} {:13.3f} {:10.3f}  {}\n",
                        board.station, board.points, 100 * board.kept_of_white, board.dense_plane_rms_mm,
                        board.dense_plane_rms_untrimmed_mm, 100 * board.trimmed_share, board.dense_shape_rms_mm,
                        board.corner_plane_rms_mm, board.pitch_rms_mm, diagonals);
  };
  for (const HeldOutBoard& board : validation.boards) {
    row(board, fmt::format("{:+.2f} {:+.2f}", board.diagonal_error_mm[0], board.diagonal_error_mm[1]));
  }
  row(validation.mean, fmt::format("{:.3f}", validation.mean.diagonal_error_mm[0]));
  for (const HeldOutBoard& board : validation.boards) {
    if (board.trimmed_share <= kUsualTrim) continue;
    text += fmt::format("station {} has gross errors: {:.1f} % of its points lie beyond five robust sigmas\n",
                        board.station, 100 * board.trimmed_share);
  }
  return text;
}

}  // namespace crumple
