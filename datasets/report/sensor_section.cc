#include "datasets/report/sensor_section.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "datasets/report/histogram_plot.h"
#include "datasets/report/html.h"
#include "datasets/report/image_plots.h"

namespace crumple {
namespace {

constexpr std::size_t kArrowsOfAll = 1500;  // residuals drawn, over all sensors
constexpr std::size_t kArrowsOfOne = 200;

std::string field_words(const ImageCells& cells) {
  if (!(cells.expected_px > 0)) return "No cell holds enough observations for a mean.";
  return fmt::format("Mean residual of each cell. They are {} px long (RMS) where independent noise would leave {} px.",
                     html_number(cells.rms_mean_px, 4), html_number(cells.expected_px, 4));
}

std::string histogram_words(const ResidualHistogram& histogram) {
  return fmt::format(
      "{}: every coordinate over its group's sigma. Accepted ones have mean {} and standard deviation {}; {} "
      "lie outside the drawing.",
      html_text(histogram.group), html_number(histogram.mean, fmt::format("{:+.3f}", histogram.mean)),
      html_number(histogram.deviation, 3), html_number(histogram.beyond));
}

std::string uncertainty_figure(ImageSize size, const ImageCells& cells, const SensorUncertainty& uncertainty,
                               ReportFigures& figures) {
  const double mm = uncertainty.distance_mm;
  return figures.add(
      image_map_plot(size, {cells.columns, cells.rows, uncertainty.sigma_px, "standard uncertainty (px)"}),
      fmt::format("How well it is known where a point is seen that lies {} away, fixed to what was observed: the "
                  "standard uncertainty of its pixel in the direction where that is largest.",
                  std::isinf(mm) ? "infinitely far" : html_number(mm, fmt::format("{:.0f}", mm)) + " mm"));
}

std::string sensor_section(const CalibrationReport& report, std::size_t s, ReportFigures& figures) {
  const Sensor& sensor = report.calibration.bundle.state.rig.sensors[s];
  const ImageSize size = sensor.lens.size();
  const ImageCells& cells = report.figures.cells[s];
  const auto& residuals = report.figures.residuals[s];
  const std::size_t most = std::min(kArrowsOfOne, kArrowsOfAll / report.figures.cells.size());
  std::string html =
      fmt::format("<section class=\"sensor\" id=\"sensor-{0}\">\n<h3>{0}</h3>\n<div>\n", html_text(sensor.name));
  if (residuals.empty()) return html + "<p>Nothing was observed with it.</p>\n</div>\n</section>\n";
  html += figures.add(
      coverage_plot(size, cells),
      fmt::format("Accepted observations per cell; {} of the image's {} cells hold any.",
                  html_number(cells.covered, fmt::format("{:.0f} %", 100 * cells.covered)), cells.cells.size()));
  if (const auto& uncertainty = report.figures.uncertainties[s]) {
    html += uncertainty_figure(size, cells, *uncertainty, figures);
  }
  for (const SensorUncertainty& map : report.figures.maps[s]) html += uncertainty_figure(size, cells, map, figures);
  html += figures.add(residual_field_plot(size, cells), field_words(cells));
  html += figures.add(residual_sample_plot(size, residuals, most),
                      fmt::format("Single residuals, {} of {}; outliers in orange.", std::min(most, residuals.size()),
                                  residuals.size()));
  for (std::size_t g = 0; g < report.figures.histograms.size(); ++g) {
    if (report.calibration.bundle.groups[g].sensor != s) continue;
    const ResidualHistogram& histogram = report.figures.histograms[g];
    html += figures.add(histogram_plot(histogram), histogram_words(histogram));
  }
  return html + "</div>\n</section>\n";
}

}  // namespace

std::string noise_section(const Calibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  const BundleResult& bundle = calibration.bundle;
  for (const GroupSummary& group : bundle.groups) {
    const double share = static_cast<double>(group.outliers) / static_cast<double>(group.observations);
    rows.push_back({html_text(group_name(bundle.state.rig, group.sensor, group.kind)), html_number(group.observations),
                    html_number(group.outliers), fmt::format("{:.2f} %", 100 * share), html_number(group.redundancy, 1),
                    html_number(calibration.inflation.of(group.kind), 2), html_number(group.rms_px, 4),
                    html_number(group.sigma_px, 4) + (group.sigma_estimated ? "" : " (assumed)")});
  }
  return "<section id=\"noise\">\n<h2>Noise</h2>\n<p>Sigma is the standard deviation of one measured coordinate, "
         "estimated from the group's residuals over its redundancy; RMS the length of the residual vector. Correlated "
         "observations count for their effective number.</p>\n" +
         html_table({{"Group", true},
                     {"Observations"},
                     {"Outliers"},
                     {""},
                     {"Redundancy"},
                     {"Counted as one"},
                     {"RMS, px"},
                     {"Sigma, px"}},
                    rows) +
         "</section>\n";
}

std::string pattern_section(const CalibrationFigures& figures, const Calibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const RegionalTest& test : figures.regional) {
    if (test.parts == 0) continue;
    rows.push_back({html_text(group_name(calibration.bundle.state.rig, test.sensor, test.kind)),
                    std::to_string(test.parts), html_number(test.chi_square, 1),
                    std::to_string(test.degrees_of_freedom),
                    html_number(test.probability, fmt::format("{:.2g}", test.probability)),
                    fmt::format("{:.2f}", test.rms_sigmas), test.pattern() ? "pattern" : "", html_text(test.worst_part),
                    fmt::format("{:+.4f}, {:+.4f}", test.worst_mean_px.x(), test.worst_mean_px.y()),
                    html_number(test.worst_probability, fmt::format("{:.2g}", test.worst_probability))});
  }
  return fmt::format(
             "<section id=\"patterns\">\n<h2>Patterns over the image</h2>\n<p>The mean residuals of an image's nine "
             "parts against what noise makes of them. A model that is enough leaves a chi-square about as large as its "
             "degrees of freedom (DoF), and the probability of a larger one is not small. A pattern is spoken of where "
             "that "
             "is below {:g} and the means of all parts (RMS), or of the worst by itself, are {:g} of a reading's "
             "sigma.</p>\n",
             kPatternProbability, kPatternSigmas) +
         html_table({{"Group", true},
                     {"Parts"},
                     {"Chi-square"},
                     {"DoF"},
                     {"Probability"},
                     {"RMS, sigmas"},
                     {"", true},
                     {"Worst part", true},
                     {"Its mean, px"},
                     {"Probability"}},
                    rows) +
         "</section>\n";
}

std::string sensor_sections(const CalibrationReport& report, ReportFigures& figures) {
  std::string html =
      "<section id=\"sensors\">\n<h2>Sensor by sensor</h2>\n<p>Residuals are predicted minus measured, drawn where "
      "they "
      "were measured. Those of a projector's stripes lie along the stripes' normal, at the projector pixel that lit "
      "the place.</p>\n";
  for (std::size_t s = 0; s < report.figures.cells.size(); ++s) html += sensor_section(report, s, figures);
  return html + "</section>\n";
}

}  // namespace crumple
