#include "datasets/report/calibration_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_system_data.h"

namespace crumple {
namespace {

using testing::HasSubstr;
using testing::Not;

// A calibration whose names are as bad as names may be, and its report with figures from so many threads.
std::string report_of_made_system(int threads) {
  const MadeSystem made = make_system({.leds = 4, .stations = 6, .tracker_placements = 5});
  const CalibrationData data = data_of(made);
  const Calibration calibration{.placement_names = data.placement_names,
                                .station_names = data.station_names,
                                .start = made.truth,
                                .bundle = refine(made.truth, made.observations, {}).value()};
  Capture capture;
  capture.title = "A <probe> & its `trackers`";
  capture.boards = data.boards;
  capture.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.002, .expansion_per_k = 9e-6};
  capture.boards[1].certificate =
      BoardCertificate{.pitch_sigma_mm = 0.002, .expansion_per_k = 7e-6, .expansion_sigma_per_k = 0};
  const Verdict verdict{false, false, {"a reason, \"quoted\""}, {"a note"}};
  const std::vector<SkippedView> skipped{{"7", "cam0", "too dark <10 %", true}};
  const std::optional<CrossValidation> validation =
      CrossValidation{{{.station = "placement_1", .points = 17}}, {.station = "mean", .points = 17}};
  const std::optional<FoldDifferences> folds = FoldDifferences{
      {{{"a", "<b>"}, ""}, {{"c"}, "too <few>"}}, {{.name = "cam<0>", .unit = "px", .ratio = 1.25}}, {}};
  const RunRecord record{"1.2.3", "calibrate", "2024-05-06", {{"out", "rig"}}, {}, {{"capture.yaml", 3, "ab12"}}};
  const CalibrationFigures figures = calibration_figures(data, calibration, threads);
  const auto html = calibration_report_html(
      {capture, calibration, verdict, figures, skipped, folds, validation, record, "crumple calibrate capture.yaml"});
  return html ? *html : html.error().message;
}

TEST(CalibrationReport, TheSameBitsAtAnyNumberOfThreads) {
  const std::string html = report_of_made_system(1);
  EXPECT_EQ(report_of_made_system(2), html);
  EXPECT_THAT(html,
              HasSubstr("<h1>Calibration report</h1>\n<p class=\"subtitle\">A &lt;probe&gt; &amp; its `trackers`"));
  EXPECT_THAT(html, HasSubstr("Verdict: suspect"));
  EXPECT_THAT(html, HasSubstr("a reason, &quot;quoted&quot;"));
  EXPECT_THAT(html, HasSubstr("too dark &lt;10 %"));
  EXPECT_THAT(html, HasSubstr("The scale's uncertainty is unknown"));
  EXPECT_THAT(html, HasSubstr("expansion 9e-06 /K, u not stated"));
  EXPECT_THAT(html, HasSubstr("expansion 7e-06 /K, u = 0 /K"));
  EXPECT_THAT(html, HasSubstr("placement_1"));
  EXPECT_THAT(html, HasSubstr("cam&lt;0&gt;"));
  EXPECT_THAT(html, HasSubstr("without c nothing is compared: too &lt;few&gt;"));
  EXPECT_THAT(html, HasSubstr("Points in the measuring volume"));
  EXPECT_THAT(html, HasSubstr("ab12"));
  EXPECT_THAT(html, Not(HasSubstr("<!--plot")));
}

}  // namespace
}  // namespace crumple
