#include "calib/detect_board.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

constexpr int kSquare = 60;  // px of the drawing

// A board drawn large: corner 0 at (margin, margin); the square outside corner 0 is dark.
cv::Mat drawing(int columns, int rows) {
  const int margin = 2 * kSquare;
  cv::Mat image((rows - 1) * kSquare + 2 * margin, (columns - 1) * kSquare + 2 * margin, CV_8U, cv::Scalar(220));
  for (int row = -1; row < rows; ++row) {
    for (int column = -1; column < columns; ++column) {
      if ((row + column) % 2 != 0) continue;
      const cv::Rect square(margin + column * kSquare, margin + row * kSquare, kSquare, kSquare);
      cv::rectangle(image, square, cv::Scalar(30), cv::FILLED);
    }
  }
  return image;
}

struct Placed {
  cv::Mat image;
  cv::Matx33d image_from_drawing;
};

Placed place(const cv::Mat& board, double angle_rad, double scale, cv::Point2d shift, cv::Size size) {
  const double c = scale * std::cos(angle_rad), s = scale * std::sin(angle_rad);
  const cv::Point2d centre(board.cols / 2.0, board.rows / 2.0);
  cv::Matx33d m(c, -s, size.width / 2.0 + shift.x - c * centre.x + s * centre.y,  //
                s, c, size.height / 2.0 + shift.y - s * centre.x - c * centre.y,  //
                1e-4, -5e-5, 1);
  Placed placed{{}, m};
  cv::Mat large;
  const cv::Matx33d up(3, 0, 1, 0, 3, 1, 0, 0, 1);  // three samples a pixel each way, averaged below
  cv::warpPerspective(board, large, up * m, size * 3, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(220));
  cv::resize(large, placed.image, size, 0, 0, cv::INTER_AREA);
  return placed;
}

Eigen::Vector2d true_pixel(const Placed& placed, int column, int row) {
  // The squares' borders lie half a pixel before the first filled one.
  const cv::Vec3d p = placed.image_from_drawing * cv::Vec3d((column + 2) * kSquare - 0.5, (row + 2) * kSquare - 0.5, 1);
  return {p[0] / p[2], p[1] / p[2]};
}

double worst_error(const Placed& placed, const DetectedBoard& found, int columns) {
  double worst = 0;
  for (std::size_t i = 0; i < found.corners.size(); ++i) {
    const Eigen::Vector2d truth = true_pixel(placed, found.corners[i] % columns, found.corners[i] / columns);
    worst = std::max(worst, (found.pixels[i] - truth).norm());
  }
  return worst;
}

TEST(DetectBoard, FindsABoardThatTellsItsEndsApartAtAnyTurn) {
  for (const double angle_deg : {0.0, 40.0, 95.0, 180.0, 250.0}) {
    const Placed placed = place(drawing(9, 6), angle_deg * M_PI / 180, 0.6, {5, -8}, {800, 700});
    const auto found = detect_grid(placed.image, 9, 6);
    ASSERT_TRUE(found) << angle_deg << ": " << found.error().message;
    EXPECT_EQ(found->corners.size(), 54U);
    EXPECT_LT(worst_error(placed, *found, 9), 0.1) << angle_deg;
  }
}

TEST(DetectBoard, ASymmetricPrintIsReadWithXToTheRight) {
  for (const double angle_deg : {0.0, 180.0, 30.0}) {
    const auto found = detect_grid(place(drawing(9, 7), angle_deg * M_PI / 180, 0.6, {0, 0}, {800, 700}).image, 9, 7);
    ASSERT_TRUE(found);
    EXPECT_GT(found->pixels[8].x(), found->pixels[0].x());
  }
}

TEST(DetectBoard, PlacesAPartialBoardByItsVisibleEnd) {
  for (const double shift : {-170.0, 170.0}) {
    const Placed placed = place(drawing(9, 6), 0.05, 0.75, {shift, 0}, {500, 480});
    const auto found = detect_grid(placed.image, 9, 6);
    ASSERT_TRUE(found) << shift << ": " << found.error().message;
    EXPECT_LT(found->corners.size(), 54U);
    EXPECT_LT(worst_error(placed, *found, 9), 0.15) << shift;
  }
}

// Rendered from datasets/scenes/small.yaml with its board moved a little: OpenCV's plain search takes the rim on the
// right for the last column and leaves out the first, so that the board's ends seemed exchanged.
TEST(DetectBoard, ARimIsNoColumnOfCorners) {
  const cv::Mat image = cv::imread(CRUMPLE_SOURCE_DIR "/tests/data/boards/rim.png", cv::IMREAD_GRAYSCALE);
  const auto found = detect_grid(image, 9, 6);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->corners.size(), 54U);
  EXPECT_LT((found->pixels[0] - Eigen::Vector2d(89.2, 77.7)).norm(), 0.1);
}

// OpenCV's search throws dice whose state is the thread's own: what it searched before would decide what it finds now.
// Rendered as tests/cli/several_boards_test.cc does: beside a board with markers, the better part of a chessboard.
TEST(DetectBoard, FindsTheSameWhateverTheThreadSearchedBefore) {
  const cv::Mat image = cv::imread(CRUMPLE_SOURCE_DIR "/tests/data/boards/beside_markers.png", cv::IMREAD_GRAYSCALE);
  std::vector<int> corners;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 4; ++column) corners.push_back(5 * row + column);
  }
  std::optional<DetectedBoard> first;
  for (const std::uint64_t state : {std::uint64_t{0xffffffff}, std::uint64_t{1}}) {
    cv::theRNG().state = state;
    const auto found = detect_grid(image, 5, 8);
    EXPECT_EQ(cv::theRNG().state, state);
    ASSERT_TRUE(found) << state << ": " << found.error().message;
    EXPECT_EQ(found->corners, corners) << state;
    if (!first) first = *found;
    EXPECT_EQ(found->pixels, first->pixels) << state;
  }
}

TEST(DetectBoard, RefusesWhatIsAmbiguous) {
  // Both ends of the rows lie outside the image.
  const auto cut = detect_grid(place(drawing(13, 6), 0, 0.9, {0, 0}, {460, 480}).image, 13, 6);
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("cannot be told"), std::string::npos) << cut.error().message;
  EXPECT_NE(cut.error().message.find("has no markers: show it whole, or cut off by the image's border at one end only"),
            std::string::npos)
      << cut.error().message;
  // Cut off at two sides, so that a part is left that fits the board either way round.
  const auto corner = detect_grid(place(drawing(9, 6), 0.05, 0.9, {150, 140}, {500, 480}).image, 9, 6);
  ASSERT_FALSE(corner);
  EXPECT_NE(corner.error().message.find("of the board's 9 x 6, and it cannot be told which: it has no markers"),
            std::string::npos)
      << corner.error().message;
  // Too little of it to be found at all.
  const auto little = detect_grid(place(drawing(9, 6), 0.05, 0.9, {260, 220}, {500, 480}).image, 9, 6);
  ASSERT_FALSE(little);
  EXPECT_NE(little.error().message.find("a part without markers cannot be told from another"), std::string::npos)
      << little.error().message;
  EXPECT_FALSE(detect_grid(drawing(6, 6), 6, 6));
  EXPECT_FALSE(detect_grid(cv::Mat(480, 640, CV_8U, cv::Scalar(128)), 9, 6));
}

}  // namespace
}  // namespace crumple
