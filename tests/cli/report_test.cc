// report.html of a calibration: the same numbers as summary.json, nothing loaded from elsewhere, and what a browser
// makes of it on a screen and on paper.
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli/report_check.h"
#include "tests/cli/tracked_system.h"

namespace crumple {
namespace {

TEST(TrackedSystemVerbs, TheReportHoldsWhatTheSummarySays) {
  const TrackedSystem& system = TrackedSystem::get();
  ASSERT_TRUE(std::filesystem::exists(system.rig() + "/report.html")) << system.calibrated().err;
  EXPECT_EQ(wrong_in_report(system.rig()), "");
}

TEST(TrackedSystemVerbs, ABrowserShowsAndPrintsTheReport) {
  if (std::system("command -v chromium >/dev/null") != 0) {
    GTEST_SKIP() << "chromium is not installed: the report was NOT looked at in a browser (apt-get install chromium)";
  }
  const TrackedSystem& system = TrackedSystem::get();
  const TemporaryFolder home;
  const std::string screen = (home / "screen.png").string(), paper = (home / "paper.pdf").string();
  const std::string browser = "HOME='" + home.path().string() +
                              "' chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
                              "--hide-scrollbars --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir='" +
                              (home / "profile").string() + "' --window-size=1280,4000 --no-pdf-header-footer ";
  ASSERT_EQ(std::system((browser + "--screenshot='" + screen + "' --print-to-pdf='" + paper + "' 'file://" +
                         system.rig() + "/report.html' >'" + (home / "log").string() + "' 2>&1")
                            .c_str()),
            0)
      << content_of(home / "log");
  // Black on white, drawings in it: most is white, some is dark, some is coloured, from top to bottom.
  const cv::Mat3b picture = cv::imread(screen);
  ASSERT_EQ(picture.size(), cv::Size(1280, 4000));
  for (int top = 0; top < picture.rows; top += 500) {
    int dark = 0, light = 0;
    for (const cv::Vec3b& pixel : cv::Mat3b(picture.rowRange(top, top + 500).clone())) {
      const int sum = pixel[0] + pixel[1] + pixel[2];
      dark += sum < 300 ? 1 : 0;
      light += sum > 700 ? 1 : 0;
    }
    EXPECT_GT(dark, 1000) << top;
    EXPECT_GT(light, 1280 * 500 / 2) << top;
  }
  ASSERT_EQ(std::system(("pdfinfo '" + paper + "' >'" + (home / "pdf").string() + "'").c_str()), 0);
  const std::string pdf = content_of(home / "pdf");
  EXPECT_THAT(pdf, testing::HasSubstr("(A4)"));
  const int pages = std::stoi(pdf.substr(pdf.find("Pages:") + 6));
  EXPECT_GE(pages, 4);
  EXPECT_LE(pages, 20);
}

}  // namespace
}  // namespace crumple
