#include "cli/hand_eye_summary.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr double kRadianInDegrees = 180 / std::numbers::pi;

std::vector<double> numbers_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Vector3d sigmas_of(const HandEyeFit& fit, Eigen::Index first) {
  return fit.covariance.diagonal().segment<3>(first).cwiseSqrt();
}

nlohmann::json pose_json(const Pose& pose, const HandEyeFit& fit, Eigen::Index first) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {{"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"translation_mm", numbers_of(pose.translation)},
          {"rotation_sigma_deg", numbers_of(kRadianInDegrees * sigmas_of(fit, first))},
          {"translation_sigma_mm", numbers_of(sigmas_of(fit, first + 3))}};
}

nlohmann::json scatter_json(const BoardScatter& scatter) {
  return {{"pairs", scatter.pairs},
          {"rms_mm", scatter.rms_mm},
          {"median_mm", scatter.median_mm},
          {"rms_deg", kRadianInDegrees * scatter.rms_rad}};
}

nlohmann::json stream_json(const PoseStream& stream) {
  return {{"poses", stream.poses().size()},
          {"repeated", stream.repeated()},
          {"seconds", stream.last_s() - stream.first_s()},
          {"median_step_s", stream.median_step_s()}};
}

nlohmann::json start_json(const HandEyeCalibration& calibration) {
  const HandEyeStart& start = calibration.start;
  return {{"motions", calibration.motions},
          {"translation_mm", numbers_of(start.hand_from_eye.translation)},
          {"axis_rms_deg", kRadianInDegrees * start.axis_rms_rad},
          {"turn_deg", kRadianInDegrees * start.conditioning.turn_rad},
          {"cross_turn_deg", kRadianInDegrees * start.conditioning.cross_turn_rad},
          {"disagreement_deg", kRadianInDegrees * start.conditioning.disagreement_rad}};
}

}  // namespace

nlohmann::json hand_eye_summary(const HandEyeCalibration& calibration, const std::optional<PairedStreams>& streams,
                                const HandEyeVerdict& verdict) {
  const HandEyeFit& fit = calibration.fit;
  nlohmann::json json{{"schema", "crumple-hand-eye-summary/1"},
                      {"verdict", verdict.ok ? "ok" : "suspect"},
                      {"reasons", verdict.reasons},
                      {"hand_from_eye", pose_json(fit.state.hand_from_eye, fit, 0)},
                      {"world_from_board", pose_json(fit.state.world_from_board, fit, 6)},
                      {"scatter", scatter_json(calibration.scatter)},
                      {"scatter_all", scatter_json(calibration.scatter_all)},
                      {"pairs", fit.pairs.size()},
                      {"outliers", fit.pairs.size() - calibration.scatter.pairs},
                      {"noise",
                       {{"rotation_deg", kRadianInDegrees * fit.noise.rotation_rad},
                        {"position_mm", fit.noise.position_mm},
                        {"hand_share", fit.noise.hand_share}}},
                      {"correlation_inflation", fit.correlation_inflation},
                      {"start", start_json(calibration)},
                      {"paired", !streams.has_value()}};
  if (streams) {
    json["hand"] = stream_json(streams->hand());
    json["eye"] = stream_json(streams->eye());
  }
  if (calibration.offset) {
    json["time_offset"] = {{"offset_s", fit.state.offset_s},
                           {"sigma_s", std::sqrt(fit.covariance(12, 12))},
                           {"by_rates_s", calibration.offset->offset_s},
                           {"by_rates_sigma_s", calibration.offset->sigma_s},
                           {"correlation", calibration.offset->correlation},
                           {"rival_correlation", calibration.offset->rival_correlation}};
  }
  return json;
}

std::string hand_eye_text(const HandEyeCalibration& calibration, const HandEyeVerdict& verdict) {
  const HandEyeFit& fit = calibration.fit;
  std::string text = fmt::format("verdict: {}\n", verdict.ok ? "ok" : "suspect");
  for (const std::string& reason : verdict.reasons) text += fmt::format("  {}\n", reason);
  text += fmt::format("pairs: {}, outliers {}\n", fit.pairs.size(), fit.pairs.size() - calibration.scatter.pairs);
  const Eigen::Vector3d turn = kRadianInDegrees * rotation_vector(fit.state.hand_from_eye.rotation);
  const Eigen::Vector3d turn_sigma = kRadianInDegrees * sigmas_of(fit, 0), shift_sigma = sigmas_of(fit, 3);
  const Eigen::Vector3d& shift = fit.state.hand_from_eye.translation;
  text += "hand_from_eye\n";
  for (Eigen::Index i = 0; i < 3; ++i) {
    text += fmt::format("  {}  {:10.3f} +- {:.3f} mm   rotation vector {:10.4f} +- {:.4f} deg\n", "xyz"[i], shift[i],
                        shift_sigma[i], turn[i], turn_sigma[i]);
  }
  if (calibration.offset) {
    text +=
        fmt::format("time offset: {:.3f} +- {:.3f} ms (hand time = eye time + offset; correlation {:.3f})\n",
                    1e3 * fit.state.offset_s, 1e3 * std::sqrt(fit.covariance(12, 12)), calibration.offset->correlation);
  } else {
    text += "paired: the poses of both files belong together line by line, whatever their times\n";
  }
  text += fmt::format(
      "board scatter: {:.3f} mm, {:.3f} deg RMS, median {:.3f} mm; over all pairs {:.3f} mm, {:.3f} deg\n",
      calibration.scatter.rms_mm, kRadianInDegrees * calibration.scatter.rms_rad, calibration.scatter.median_mm,
      calibration.scatter_all.rms_mm, kRadianInDegrees * calibration.scatter_all.rms_rad);
  return text;
}

}  // namespace crumple
