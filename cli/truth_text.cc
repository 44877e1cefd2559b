#include "cli/truth_text.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "datasets/truth.h"

namespace crumple {
nlohmann::json rig_truth_json(const std::vector<ParameterTruth>& parameters) {
  nlohmann::json list = nlohmann::json::array();
  double within = 0, squares = 0;
  for (const ParameterTruth& p : parameters) {
    list.push_back({{"name", p.name},
                    {"estimate", p.estimate},
                    {"truth", p.truth},
                    {"error", p.error},
                    {"sigma", p.sigma},
                    {"z", p.z}});
    within += std::abs(p.z) <= 3 ? 1 : 0;
    squares += p.z * p.z;
  }
  const double count = std::max(1.0, static_cast<double>(parameters.size()));
  return {{"parameters", list}, {"share_within_3_sigma", within / count}, {"rms_z", std::sqrt(squares / count)}};
}

std::string rig_truth_text(const std::vector<ParameterTruth>& parameters) {
  std::string text = fmt::format("{:<22} {:>14} {:>14} {:>12} {:>12} {:>8}\n", "against the truth", "estimate", "truth",
                                 "error", "sigma", "error/s");
  std::size_t within = 0;
  for (const ParameterTruth& p : parameters) {
    text += fmt::format("  {:<20} {:>14.6f} {:>14.6f} {:>+12.6f} {:>12.6f} {:>+8.2f}\n", p.name, p.estimate, p.truth,
                        p.error, p.sigma, p.z);
    within += std::abs(p.z) <= 3 ? 1 : 0;
  }
  return text + fmt::format("within 3 sigma: {} of {}\n", within, parameters.size());
}

Expected<void> add_rig_truth(const Rig& truth, const Rig& estimated, VerbResult& result) {
  const auto parameters = compare_with_true_rig(estimated, truth);
  if (!parameters) return tl::unexpected(parameters.error());
  result.document["truth"] = rig_truth_json(*parameters);
  result.text += rig_truth_text(*parameters);
  return {};
}

Expected<void> add_system_truth(const Rig& truth, const Rig& estimated, const std::string& name, VerbResult& result) {
  const auto error = hand_eye_error(estimated, truth);
  if (!error) return tl::unexpected(error.error());
  const double deg = error->rotation_rad * 180 / std::numbers::pi;
  result.document["truth"]["hand_eye"][name] = {{"mm", error->translation_mm}, {"deg", deg}};
  result.text += fmt::format("{}: hand-eye off by {:.3f} mm, {:.4f} deg; lenses by", name, error->translation_mm, deg);
  for (const Sensor& sensor : estimated.sensors) {
    const auto known = truth.find(sensor.name);
    if (!known) return fail(fmt::format("the truth has no sensor {}", sensor.name));
    const auto off_px = lens_error_px(sensor.lens, truth.sensors[*known].lens);
    if (!off_px) return fail(fmt::format("{}: {}", sensor.name, off_px.error().message));
    result.document["truth"]["lenses_px"][name][sensor.name] = *off_px;
    result.text += fmt::format(" {} {:.3f}", sensor.name, *off_px);
  }
  result.text += " px\n";
  return {};
}

}  // namespace crumple
