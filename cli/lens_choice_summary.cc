#include "cli/lens_choice_summary.h"

#include <fmt/format.h>

namespace crumple {
namespace {

using nlohmann::json;

json candidate_json(const LensCandidate& candidate) {
  json entry{{"model", candidate.model}, {"taken", candidate.taken}, {"reason", candidate.reason}};
  if (!candidate.fitted) return entry;
  entry["rms_px"] = candidate.rms_px;
  entry["held_out_rms_px"] = candidate.held_out_rms_px;
  entry["undetermined"] = candidate.undetermined;
  if (candidate.against.empty()) return entry;
  entry["against"] = candidate.against;
  entry["wald"] = candidate.statistic;
  entry["wald_limit"] = candidate.statistic_limit;
  entry["gain_px2"] = candidate.gain_px2;
  entry["gain_sigma_px2"] = candidate.gain_sigma_px2;
  return entry;
}

const char* kind_name(const LensChoice& choice) {
  if (choice.kind == SensorKind::projector) return "projector";
  return choice.mount == Mount::world ? "tracker" : "camera";
}

// The model's name without what all of them begin with.
std::string short_name(const std::string& model) { return model.substr(std::string("LENSMODEL_").size()); }

std::string candidate_row(const LensCandidate& candidate) {
  const std::string mark = candidate.taken ? "taken: " : "";
  if (!candidate.fitted) return fmt::format("  {:9} {}\n", short_name(candidate.model), candidate.reason);
  std::string comparison(41, ' ');
  if (!candidate.against.empty()) {
    comparison = fmt::format("{:10.1f} {:5.1f} {:+11.6f} {:+11.6f}", candidate.statistic, candidate.statistic_limit,
                             candidate.gain_px2, candidate.gain_sigma_px2);
  }
  return fmt::format("  {:9} {:9.4f} {:9.4f} {:41}  {}{}\n", short_name(candidate.model), candidate.rms_px,
                     candidate.held_out_rms_px, comparison, mark, candidate.reason);
}

}  // namespace

json lens_choice_summary(const std::vector<LensChoice>& choices) {
  json summary = json::array();
  for (const LensChoice& choice : choices) {
    json candidates = json::array();
    for (const LensCandidate& candidate : choice.candidates) candidates.push_back(candidate_json(candidate));
    summary.push_back({{"kind", kind_name(choice)}, {"model", choice.model}, {"candidates", candidates}});
  }
  return summary;
}

std::string lens_choice_text(const std::vector<LensChoice>& choices) {
  std::string text;
  for (const LensChoice& choice : choices) {
    text += fmt::format("lens of the {}s, chosen by the data: {}\n", kind_name(choice), choice.model);
    text += "  model       RMS px  held out       Wald limit    gain px^2      +-\n";
    for (const LensCandidate& candidate : choice.candidates) text += candidate_row(candidate);
  }
  return text;
}

}  // namespace crumple
