#include "datasets/report/calibration_report.h"

#include <fmt/format.h>

#include "datasets/report/budget_section.h"
#include "datasets/report/capture_section.h"
#include "datasets/report/html.h"
#include "datasets/report/report_figures.h"
#include "datasets/report/rig_plot.h"
#include "datasets/report/sensor_section.h"
#include "datasets/report/validation_section.h"
#include "datasets/report/volume_section.h"

namespace crumple {
namespace {

std::string verdict_box(const Verdict& verdict) {
  std::string html =
      fmt::format("<div class=\"verdict\" id=\"verdict\">\n<strong>Verdict: {}</strong>\n", level_of(verdict));
  std::vector<std::string> reasons, notes;
  for (const std::string& reason : verdict.reasons) reasons.push_back(html_text(reason));
  for (const std::string& note : verdict.notes) notes.push_back(html_text(note));
  if (!reasons.empty()) html += html_list(reasons);
  if (!notes.empty()) html += "<p>To know all the same:</p>\n" + html_list(notes);
  return html + "</div>\n";
}

std::string rig_section(const CalibrationState& state, ReportFigures& figures) {
  const bool moved = !state.world_from_probe.empty();
  std::string html = "<section id=\"rig\">\n<h2>The rig</h2>\n<div>\n";
  html +=
      figures.add(rig_plot(state),
                  fmt::format("To scale, in the frame of the {}; pyramids show which way sensors look, not how far{}.",
                              moved ? "world" : "probe", moved ? ", those of the probe at its first station" : ""),
                  true);
  html += figures.add(rig_plan(state), "The same from above.", true);
  return html + "</div>\n</section>\n";
}

}  // namespace

Expected<std::string> calibration_report_html(const CalibrationReport& report) {
  ReportFigures figures;
  std::string body = "<h1>Calibration report</h1>\n<p class=\"subtitle\">" + html_text(report.capture.title) + "</p>\n";
  body += verdict_box(report.verdict);
  body += capture_section(report);
  body += budget_section(report);
  body += noise_section(report.calibration);
  body += pattern_section(report.figures, report.calibration);
  body += sensor_sections(report, figures);
  body += volume_section(report.figures, report.calibration);
  body += correlation_section(report.figures.correlated, report.calibration.bundle.covariance);
  body += validation_section(report.folds, report.validation);
  body += rig_section(report.calibration.bundle.state, figures);
  body += inputs_section(report.record, report.command);
  return figures.fill(html_page("Calibration report: " + report.capture.title, body));
}

}  // namespace crumple
