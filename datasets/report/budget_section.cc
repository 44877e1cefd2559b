#include "datasets/report/budget_section.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/report/html.h"

namespace crumple {
namespace {

constexpr double kWorthNaming = 0.1;         // share of a source in the variance
constexpr double kNegligible = 0.01;         // share of the other type
constexpr std::size_t kLensTermsShown = 16;  // a splined lens has hundreds

std::string type_of(const BudgetEntry& entry) {
  if (entry.type_b_share < kNegligible) return "A";
  return entry.type_b_share > 1 - kNegligible ? "B" : "A + B";
}

// Rounded down, as GUM, G.4.1 has it.
std::string degrees_cell(double degrees) {
  return std::isfinite(degrees) ? html_number(degrees, fmt::format("{:.0f}", std::floor(degrees))) : "∞";
}

std::string sources_cell(const BudgetEntry& entry, const std::vector<BudgetSource>& sources) {
  std::vector<std::size_t> order;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (entry.shares[s] > kWorthNaming) order.push_back(s);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return entry.shares[a] > entry.shares[b]; });
  std::string text;
  for (const std::size_t s : order) {
    text +=
        fmt::format("{}{} {:.0f}\u00a0%", text.empty() ? "" : ", ", html_text(sources[s].name), 100 * entry.shares[s]);
  }
  return text;
}

std::string short_name(const std::string& name) { return name.substr(name.rfind('.') + 1); }

std::string budget_table(const UncertaintyBudget& budget) {
  std::vector<std::vector<std::string>> rows;
  std::string part;
  std::size_t shown = 0;
  for (const BudgetEntry& entry : budget.entries) {
    if (entry.part != part) {
      rows.push_back({html_text(entry.part)});
      shown = 0;
    }
    part = entry.part;
    if (++shown > kLensTermsShown) continue;
    rows.push_back({html_text(short_name(entry.name)), html_value(entry.value, entry.u), html_uncertainty(entry.u),
                    html_uncertainty(kCoverageFactor * entry.u), html_text(entry.unit),
                    degrees_cell(entry.degrees_of_freedom), type_of(entry), sources_cell(entry, budget.sources)});
  }
  return html_table({{"Parameter", true},
                     {"Value"},
                     {"<i>u</i>"},
                     {fmt::format("<i>U</i> (<i>k</i> = {:g})", kCoverageFactor)},
                     {"Unit", true},
                     {"<i>ν</i><sub>eff</sub>"},
                     {"Type", true},
                     {"Sources, share of <i>u</i>²", true}},
                    rows);
}

std::string scale_words(const std::optional<ScaleUncertainty>& scale) {
  if (!scale) {
    return "<strong>The scale's uncertainty is unknown</strong>: no board has a certificate, and there is no scale "
           "bar. It "
           "is not contained in any length below.";
  }
  std::string words =
      fmt::format("Lengths contain the scale's standard uncertainty by the certificates, {} of themselves.",
                  html_number(scale->relative, fmt::format("{:.2g}", scale->relative)));
  if (!scale->lacks.empty()) {
    words += " It is not complete: " + html_text(fmt::format("{}", fmt::join(scale->lacks, "; "))) + ".";
  }
  return words;
}

}  // namespace

std::string budget_section(const CalibrationReport& report) {
  return "<section id=\"budget\">\n<h2>Uncertainty budget</h2>\n<p>After the GUM (JCGM 100:2008): value, standard "
         "uncertainty <i>u</i>, expanded uncertainty <i>U</i> = <i>k u</i>, effective degrees of freedom by Welch and "
         "Satterthwaite. Type A comes from the observations' own scatter, type B from certificates, earlier rigs, weak "
         "priors and assumed noise. Rotations are rotation vectors; their <i>u</i> is of a small further rotation "
         "about "
         "the sensor's axes. Sensors that define a frame have no mount.</p>\n<p>" +
         scale_words(report.calibration.scale) + "</p>\n" + budget_table(report.figures.budget) + "</section>\n";
}

std::string correlation_section(const CorrelatedTerms& correlated, const JointCovariance& covariance) {
  std::string html = fmt::format(
      "<section id=\"correlations\">\n<h2>Correlations above {:g}</h2>\n<p>The condition of the equilibrated "
      "information is {}; weakest determined: {}.</p>\n",
      kCorrelationLimit, html_number(covariance.condition(), fmt::format("{:.2g}", covariance.condition())),
      html_text(covariance.weakest_direction()));
  if (correlated.pairs == 0) return html + "<p>There is none.</p>\n</section>\n";
  html +=
      "<p>The observations can hardly tell these apart: the single values mean little, what they predict together may "
      "be known well.</p>\n";
  std::vector<std::string> items;
  for (const CorrelatedPair& pair : correlated.strongest) {
    const std::string number = html_number(pair.correlation, fmt::format("{:+.4f}", pair.correlation));
    const bool together = pair.correlation > 0;
    items.push_back(fmt::format("{} is too large where {} is too {} ({})", html_text(pair.first),
                                html_text(pair.second), together ? "large" : "small", number));
  }
  html += html_list(items, true);
  if (correlated.pairs > correlated.strongest.size()) {
    html += fmt::format("<p>and {} further pairs.</p>\n", correlated.pairs - correlated.strongest.size());
  }
  return html + "</section>\n";
}

}  // namespace crumple
