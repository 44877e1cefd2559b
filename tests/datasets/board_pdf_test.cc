#include "datasets/board_pdf.h"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/target_print.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

TEST(BoardPdf, CornersLieAtThePitchOnPaper) {
  const TemporaryFolder home;
  const Target board{10, 7, 17.5};
  const auto paper = choose_paper("auto", board);
  ASSERT_TRUE(paper);
  ASSERT_TRUE(write_board_pdf(home / "b.pdf", board, *paper));
  constexpr double px_per_mm = 254 / 25.4;
  const std::string command =
      "pdftoppm -r 254 -gray '" + (home / "b.pdf").string() + "' '" + (home / "b").string() + "'";
  if (std::system("pdftoppm -v 2>/dev/null") != 0) GTEST_SKIP() << "poppler-utils is not installed";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const cv::Mat image = cv::imread((home / "b-1.pgm").string(), cv::IMREAD_GRAYSCALE);
  ASSERT_NEAR(image.cols, paper->width_mm * px_per_mm, 2);
  std::vector<cv::Point2f> corners;
  ASSERT_TRUE(cv::findChessboardCorners(image, {board.columns, board.rows}, corners));
  cv::cornerSubPix(image, corners, {15, 15}, {-1, -1}, {cv::TermCriteria::EPS, 0, 1e-4});
  // Board frame: x to the right, y down, from the corner at the black top left square.
  const double pitch_px = board.pitch_mm * px_per_mm;
  const double raster_px = 0.55;  // poppler moves edges to whole pixels
  for (int i = 0; i < board.columns * board.rows; ++i) {
    const cv::Point2f& corner = corners[static_cast<std::size_t>(i)];
    EXPECT_NEAR(corner.x - corners[0].x, (i % board.columns) * pitch_px, raster_px) << i;
    EXPECT_NEAR(corner.y - corners[0].y, (i / board.columns) * pitch_px, raster_px) << i;
  }
  const cv::Point inside(cvRound(corners[0].x - pitch_px / 2), cvRound(corners[0].y - pitch_px / 2));
  EXPECT_EQ(image.at<uchar>(inside), 0);
}

class EveryTargetOnPaper : public testing::TestWithParam<Target> {};

// Every pixel that is not on an edge, against the shapes.
TEST_P(EveryTargetOnPaper, IsDarkWhereItShouldBe) {
  if (std::system("pdftoppm -v 2>/dev/null") != 0) GTEST_SKIP() << "poppler-utils is not installed";
  const TemporaryFolder home;
  const auto paper = choose_paper("auto", GetParam()).value();
  ASSERT_TRUE(write_board_pdf(home / "b.pdf", GetParam(), paper));
  constexpr double px_per_mm = 254 / 25.4;
  const std::string command =
      "pdftoppm -r 254 -gray '" + (home / "b.pdf").string() + "' '" + (home / "b").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const cv::Mat image = cv::imread((home / "b-1.pgm").string(), cv::IMREAD_GRAYSCALE);
  const TargetPrint print(GetParam());
  const Eigen::Vector2d low = print.extent().low_mm, size = print.extent().high_mm - low;
  constexpr double footer_mm = 18, edge_mm = 0.11;
  const Eigen::Vector2d corner = 0.5 * (Eigen::Vector2d(paper.width_mm, paper.height_mm - footer_mm) - size);
  int compared = 0, dark = 0;
  for (int y = 0; y < size.y() * px_per_mm; y += 3) {
    for (int x = 0; x < size.x() * px_per_mm; x += 3) {
      const Eigen::Vector2d at(x / px_per_mm, y / px_per_mm);
      const bool expected = print.dark(low + at);
      bool clear = true;
      for (const double dx : {-edge_mm, edge_mm}) {
        for (const double dy : {-edge_mm, edge_mm}) {
          clear = clear && print.dark(low + at + Eigen::Vector2d(dx, dy)) == expected;
        }
      }
      if (!clear) continue;
      const Eigen::Vector2d pixel = (corner + at) * px_per_mm;
      const auto value = image.at<std::uint8_t>(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
      ASSERT_EQ(value < 128, expected) << at.transpose();
      ++compared;
      dark += expected ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 10000);
  EXPECT_GT(dark, compared / 10);
}

INSTANTIATE_TEST_SUITE_P(Targets, EveryTargetOnPaper,
                         testing::Values(Target{6, 5, 20}, Target{6, 5, 20, TargetKind::charuco, 15, "5X5_100", 7},
                                         Target{4, 3, 30, TargetKind::apriltag, 24, "APRILTAG_36h11"},
                                         Target{6, 5, 20, TargetKind::dots, 10},
                                         Target{4, 7, 30, TargetKind::dots, 10, {}, 0, true}));

TEST(BoardPdf, SaysHowToPrintIt) {
  const TemporaryFolder home;
  const Target board{6, 9, 10};
  ASSERT_TRUE(write_board_pdf(home / "b.pdf", board, choose_paper("auto", board).value()));
  const std::string command = "pdftotext '" + (home / "b.pdf").string() + "' '" + (home / "b.txt").string() + "'";
  if (std::system("pdftotext -v 2>/dev/null") != 0) GTEST_SKIP() << "poppler-utils is not installed";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(content_of(home / "b.txt"), HasSubstr("Print at 100 %"));
  EXPECT_THAT(content_of(home / "b.txt"), HasSubstr("chessboard, 6 x 9 inner corners, pitch 10 mm"));
}

TEST(BoardPdf, SameInputSameBytes) {
  const TemporaryFolder home;
  const Target board{6, 9, 10};
  for (const char* const name : {"a.pdf", "b.pdf"})
    ASSERT_TRUE(write_board_pdf(home / name, board, choose_paper("auto", board).value()));
  EXPECT_EQ(content_of(home / "a.pdf"), content_of(home / "b.pdf"));
}

TEST(BoardPdf, ChoosesPaper) {
  const auto name = [](const std::string& paper, const Target& board) {
    const auto chosen = choose_paper(paper, board);
    return chosen ? chosen->name : chosen.error().message;
  };
  EXPECT_EQ(name("auto", {10, 7, 20}), "A4 landscape");
  EXPECT_EQ(name("auto", {7, 10, 20}), "A4 portrait");
  EXPECT_EQ(name("auto", {14, 10, 100}), "1520 x 1138 mm");
  EXPECT_EQ(name("A3", {10, 7, 20}), "A3 landscape");
  EXPECT_EQ(name("400x300", {10, 7, 20}), "400 x 300 mm");
  EXPECT_THAT(name("A4", {10, 7, 30}), HasSubstr("350 x 278 mm"));
  EXPECT_THAT(name("A9", {10, 7, 30}), HasSubstr("not a paper size"));
  EXPECT_THAT(name("400x", {10, 7, 30}), HasSubstr("not a paper size"));
  EXPECT_THAT(name("auto", {1, 7, 30}), HasSubstr("1 x 7"));
  EXPECT_THAT(name("auto", {10, 7, -1}), HasSubstr("pitch"));
}

}  // namespace
}  // namespace crumple
