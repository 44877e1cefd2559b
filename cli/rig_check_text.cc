#include "cli/rig_check_text.h"

#include <fmt/format.h>

namespace crumple {

namespace {

// "0.21 mm", or "0.35 mm or 0.012 deg".
std::string limit_text(const PartCheck& part) {
  std::string text = fmt::format("{:.2g} mm", *part.would_show_mm);
  if (part.would_show_deg) text += fmt::format(" or {:.2g} deg", *part.would_show_deg);
  return text;
}

nlohmann::json number_or_null(const std::optional<double>& number) {
  return number ? nlohmann::json(*number) : nlohmann::json();
}

}  // namespace

std::string unexplained_text(const RigCheck& check) {
  constexpr double kByChance = 1e-3;
  std::string text;
  for (const auto& [group, factor] : check.noisier) {
    text += fmt::format("{} scatter {:.2g} times as much as at the calibration, which was taken for noise\n", group,
                        factor);
  }
  if (check.probability < kByChance && !check.moved) {
    text += fmt::format(
        "the LEDs and boards fit the rig less well than noise alone would have it (p = {:.1g}), and no single change "
        "explains it\n",
        check.probability);
  }
  return text;
}

std::string moved_text(const MovedMeanwhile& moved) {
  return fmt::format("moved while the images were taken: {}\n", moved.what);
}

std::string rig_check_text(const RigCheck& check) {
  std::string text =
      fmt::format("rig: {}, {} parts tested; chi-square {:.0f} of {:.0f} with all of them unchanged\n",
                  check.valid() ? "valid" : "changed", check.parts.size(), check.square_sum, check.redundancy);
  for (const PartChange& change : check.changed) {
    const PartCheck& part = check.parts[change.part];
    text +=
        fmt::format("  {} changed by {} (chi-square {:.1f} of {})\n", part.name, part.how_far, part.gain, part.degrees);
    for (const std::size_t other : change.or_else) {
      text += fmt::format("    or else {} by {}: these observations do not tell which\n", check.parts[other].name,
                          check.parts[other].how_far);
    }
  }
  if (check.moved) text += moved_text(*check.moved);
  text += unexplained_text(check);
  for (const PartCheck& part : check.parts) {
    if (part.would_show_mm) text += fmt::format("  {}: a change shows from {} on\n", part.name, limit_text(part));
  }
  return text;
}

nlohmann::json rig_check_json(const RigCheck& check) {
  const auto part_json = [&](std::size_t index) {
    const PartCheck& part = check.parts[index];
    return nlohmann::json{{"part", part.name},
                          {"chi_square", part.gain},
                          {"degrees", part.degrees},
                          {"probability", part.probability},
                          {"how_far", part.how_far},
                          {"would_show_mm", number_or_null(part.would_show_mm)},
                          {"would_show_deg", number_or_null(part.would_show_deg)}};
  };
  nlohmann::json document{{"valid", check.valid()},
                          {"chi_square", check.square_sum},
                          {"redundancy", check.redundancy},
                          {"probability", check.probability},
                          {"noisier", check.noisier},
                          {"parts", nlohmann::json::array()},
                          {"changed", nlohmann::json::array()}};
  for (std::size_t p = 0; p < check.parts.size(); ++p) document["parts"].push_back(part_json(p));
  for (const PartChange& change : check.changed) {
    nlohmann::json entry = part_json(change.part);
    entry["or_else"] = nlohmann::json::array();
    for (const std::size_t other : change.or_else) entry["or_else"].push_back(check.parts[other].name);
    document["changed"].push_back(entry);
  }
  if (check.moved) document["moved"] = check.moved->what;
  return document;
}

}  // namespace crumple
