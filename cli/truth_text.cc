#include "cli/truth_text.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/truth.h"

namespace crumple {
nlohmann::json rig_truth_json(const RigTruth& compared) {
  nlohmann::json list = nlohmann::json::array();
  double within = 0, squares = 0;
  for (const ParameterTruth& p : compared.parameters) {
    list.push_back({{"name", p.name},
                    {"estimate", p.estimate},
                    {"truth", p.truth},
                    {"error", p.error},
                    {"sigma", p.sigma},
                    {"z", p.z}});
    within += std::abs(p.z) <= 3 ? 1 : 0;
    squares += p.z * p.z;
  }
  const double count = std::max(1.0, static_cast<double>(compared.parameters.size()));
  return {{"parameters", list},
          {"share_within_3_sigma", within / count},
          {"rms_z", std::sqrt(squares / count)},
          {"not_compared", compared.not_compared}};
}

std::string rig_truth_text(const RigTruth& compared) {
  std::string text = fmt::format("{:<22} {:>14} {:>14} {:>12} {:>12} {:>8}\n", "against the truth", "estimate", "truth",
                                 "error", "sigma", "error/s");
  std::size_t within = 0;
  for (const ParameterTruth& p : compared.parameters) {
    text += fmt::format("  {:<20} {:>14.6f} {:>14.6f} {:>+12.6f} {:>12.6f} {:>+8.2f}\n", p.name, p.estimate, p.truth,
                        p.error, p.sigma, p.z);
    within += std::abs(p.z) <= 3 ? 1 : 0;
  }
  text += fmt::format("within 3 sigma: {} of {}\n", within, compared.parameters.size());
  if (compared.not_compared.empty()) return text;
  return text + fmt::format("not compared, being unknown to the truth or in no frame in common with it: {}\n",
                            fmt::join(compared.not_compared, ", "));
}

Expected<void> add_rig_truth(const Rig& truth, const Rig& estimated, VerbResult& result) {
  const auto compared = compare_with_true_rig(estimated, truth);
  if (!compared) return tl::unexpected(compared.error());
  result.document["truth"] = rig_truth_json(*compared);
  result.text += rig_truth_text(*compared);
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
    if (!known) continue;
    const auto off_px = lens_error_px(sensor.lens, truth.sensors[*known].lens);
    if (!off_px) return fail(fmt::format("{}: {}", sensor.name, off_px.error().message));
    result.document["truth"]["lenses_px"][name][sensor.name] = *off_px;
    result.text += fmt::format(" {} {:.3f}", sensor.name, *off_px);
  }
  result.text += " px\n";
  return {};
}

}  // namespace crumple
