#include "cli/acceptance.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace crumple {
namespace {

using nlohmann::json;

constexpr double kLeftOut = 0.003;    // of the points, at most
constexpr double kGuardBand = 1.645;  // of a normal distribution one in twenty lies above so many sigmas
// Positions in the measuring volume that VDI/VDE 2634 part 2 asks for.
constexpr std::size_t kSpheresAsked = 10, kBarsAsked = 7, kPlatesAsked = 6;

// The range of the residuals without the farthest.
double observed_range(const std::vector<double>& residuals) {
  std::vector<double> sorted = residuals;
  std::sort(sorted.begin(), sorted.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  sorted.resize(sorted.size() - static_cast<std::size_t>(kLeftOut * static_cast<double>(sorted.size())));
  const auto [least, most] = std::minmax_element(sorted.begin(), sorted.end());
  return *most - *least;
}

double predicted_range(const std::vector<double>& sigmas) {
  const auto count = static_cast<double>(sigmas.size());
  const double share = std::max(kLeftOut, 0.5 / count);
  const auto beyond = [&](double z) {
    double sum = 0;
    for (const double sigma : sigmas) sum += sigma > 0 ? std::erfc(z / (sigma * std::sqrt(2.0))) : 0;
    return sum / count;
  };
  double low = 0, high = 10 * *std::max_element(sigmas.begin(), sigmas.end());
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (beyond(middle) > share ? low : high) = middle;
  }
  return 2 * high;
}

// The report as it grows.
class Acceptance {
 public:
  Acceptance(const MeasuredCloud& cloud, const AcceptancePlan& plan) : cloud_(cloud), plan_(plan) {
    result_.report.document = {{"schema", "crumple-vdi2634-report/1"}, {"results", json::array()}};
    add_scale(cloud, result_.report.document);
    result_.report.text = fmt::format("{:<28}{:>10}{:>12}{:>9}{:>10}\n", "VDI/VDE 2634 (mm)", "observed", "predicted",
                                      "U (k=2)", "stations");
  }

  // A range, observed against predicted.
  void add_form(const std::string& what, const std::string& symbol, const std::string& name,
                const MeasuredFeature& feature) {
    const double observed = observed_range(feature.residuals_mm);
    const double predicted = predicted_range(feature.residual_sigmas_mm);
    const std::size_t stations = cloud_.stations_of(feature);
    result_.report.document["results"].push_back({{"what", what},
                                                  {"of", name},
                                                  {"observed_mm", observed},
                                                  {"predicted_mm", predicted},
                                                  {"points", feature.residuals_mm.size()},
                                                  {"stations", stations}});
    const std::string line =
        fmt::format("  {:<26}{:10.4f}{:12.4f}{:>9}{:10}", symbol + " " + name, observed, predicted, "", stations);
    finish(what, observed, 0, line);
    ++(feature.kind == MeasuredFeature::Kind::plane ? plates_ : spheres_);
  }

  // An error against a certificate, whose expectation is zero.
  void add_error(const std::string& what, const std::string& symbol, const std::string& name, MeasuredQuantity found,
                 double certified_mm, double certificate_sigma_mm, std::size_t stations) {
    found.budget.other = certificate_sigma_mm * certificate_sigma_mm;
    found.value -= certified_mm;
    json entry = quantity_json(found, cloud_.scale_known());
    entry["observed_mm"] = entry["value"];
    entry.erase("value");
    entry["what"] = what;
    entry["of"] = name;
    entry["stations"] = stations;
    const double expanded = 2 * found.budget.sigma();
    entry["within_U"] = std::abs(found.value) <= expanded;
    result_.report.document["results"].push_back(std::move(entry));
    const std::string line =
        fmt::format("  {:<26}{:+10.4f}{:12}{:9.4f}{:10}", symbol + " " + name, found.value, 0, expanded, stations) +
        (std::abs(found.value) <= expanded ? "" : "  beyond U");
    finish(what, std::abs(found.value), certificate_sigma_mm, line);
  }

  AcceptanceReport done() {
    result_.report.text += scale_sentence(cloud_);
    const std::size_t bars = plan_.bars.size();
    const bool complete = spheres_ >= kSpheresAsked && bars >= kBarsAsked && plates_ >= kPlatesAsked;
    result_.report.document["positions"] = {
        {"spheres", spheres_}, {"ball_bars", bars}, {"plates", plates_}, {"complete", complete}};
    if (!complete) {
      result_.report.text += fmt::format(
          "a reduced test: part 2 asks for {} positions of a sphere, {} of a ball bar and {} of a plate, here are {}, "
          "{} and {}\n",
          kSpheresAsked, kBarsAsked, kPlatesAsked, spheres_, bars, plates_);
    }
    if (!plan_.limits_mm.empty()) result_.report.text += result_.accepted ? "accepted\n" : "not accepted\n";
    result_.report.document["accepted"] = plan_.limits_mm.empty() ? json(nullptr) : json(result_.accepted);
    return std::move(result_);
  }

 private:
  void finish(const std::string& what, double size, double certificate_sigma_mm, const std::string& line) {
    result_.report.text += line;
    if (const auto limit = plan_.limits_mm.find(what); limit != plan_.limits_mm.end()) {
      const double guard_mm = kGuardBand * certificate_sigma_mm;
      const bool kept = size <= limit->second - guard_mm, exceeded = size > limit->second + guard_mm;
      const char* const verdict = kept ? "kept" : exceeded ? "exceeded" : "undecided";
      result_.accepted = result_.accepted && kept;
      json& entry = result_.report.document["results"].back();
      entry["limit_mm"] = limit->second;
      entry["limit"] = verdict;
      result_.report.text += fmt::format("  limit {} {}", limit->second, verdict);
    }
    result_.report.text += "\n";
  }

  const MeasuredCloud& cloud_;
  const AcceptancePlan& plan_;
  AcceptanceReport result_;
  std::size_t spheres_ = 0, plates_ = 0;
};

}  // namespace

Expected<AcceptanceReport> acceptance_report(const MeasuredCloud& cloud, const AcceptancePlan& plan) {
  const auto measured = cloud.measure(plan.features);
  if (!measured) return tl::unexpected(measured.error());
  const PointUncertainty& known = cloud.uncertainty();
  Acceptance acceptance(cloud, plan);
  for (std::size_t i = 0; i < measured->size(); ++i) {
    const MeasuredFeature& feature = (*measured)[i];
    const std::string& name = plan.features[i].name;
    if (feature.kind == MeasuredFeature::Kind::plane) {
      acceptance.add_form("flatness", "F ", name, feature);
      continue;
    }
    const CertifiedLength& diameter = plan.diameters[i];
    acceptance.add_form("probing_form", "PF", name, feature);
    acceptance.add_error("probing_size", "PS", name, value_of(known, feature, 3, 2), diameter.length_mm,
                         diameter.sigma_mm, cloud.stations_of(feature));
  }
  for (const BallBar& bar : plan.bars) {
    const MeasuredFeature &from = (*measured)[bar.from], &to = (*measured)[bar.to];
    const std::size_t stations = std::min(cloud.stations_of(from), cloud.stations_of(to));
    const auto spacing = distance(known, from, to);
    if (!spacing) return fail(fmt::format("{}: {}", bar.name, spacing.error().message));
    const auto length = outer_length(known, from, to);
    if (!length) return fail(fmt::format("{}: {}", bar.name, length.error().message));
    const CertifiedLength &a = plan.diameters[bar.from], &b = plan.diameters[bar.to];
    acceptance.add_error("sphere_spacing", "SD", bar.name, *spacing, bar.length.length_mm, bar.length.sigma_mm,
                         stations);
    const double sigma = std::sqrt(bar.length.sigma_mm * bar.length.sigma_mm + a.sigma_mm * a.sigma_mm / 4 +
                                   b.sigma_mm * b.sigma_mm / 4);
    acceptance.add_error("length", "E ", bar.name, *length, bar.length.length_mm + (a.length_mm + b.length_mm) / 2,
                         sigma, stations);
  }
  return acceptance.done();
}

}  // namespace crumple
