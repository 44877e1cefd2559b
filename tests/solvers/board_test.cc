#include "solvers/board.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

Board bent_board() {
  Board board = Board::grid(5, 4, 20);
  board.warp_mm = {0.6, -0.2};
  board.scale = 1.001;
  return board;
}

TEST(Board, IsFlatAtItsCornersAndBulgesInTheMiddle) {
  Board board = Board::grid(5, 3, 20);
  board.warp_mm = {0.6, -0.2};
  EXPECT_EQ(board.point_count(), 15);
  EXPECT_EQ(board.point(0), Eigen::Vector3d::Zero());
  EXPECT_NEAR(board.point(7).z(), 0.4, 1e-15);
  EXPECT_EQ(board.point(7).head<2>(), Eigen::Vector2d(40, 20));
}

TEST(Board, ScaleStretchesTheSheetAndKeepsItsHeights) {
  const Board board = bent_board();
  Board nominal = board;
  nominal.scale = 1;
  for (int i = 0; i < board.point_count(); ++i) {
    EXPECT_LT((board.point(i).head<2>() - 1.001 * nominal.point(i).head<2>()).norm(), 1e-12);
    EXPECT_NEAR(board.point(i).z(), nominal.point(i).z(), 1e-12);
  }
}

TEST(Board, DerivativesMatchCentralDifferences) {
  const Board board = bent_board();
  constexpr double h = 1e-5;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(3, 50), Eigen::Vector2d(70, 10)}) {
    const double x = at.x(), y = at.y();
    EXPECT_NEAR(board.d_height_d_xy(x, y).x(), (board.height_mm(x + h, y) - board.height_mm(x - h, y)) / (2 * h), 1e-9);
    EXPECT_NEAR(board.d_height_d_xy(x, y).y(), (board.height_mm(x, y + h) - board.height_mm(x, y - h)) / (2 * h), 1e-9);
    Board larger = board, smaller = board;
    larger.scale += h;
    smaller.scale -= h;
    EXPECT_NEAR(board.d_height_d_scale(x, y), (larger.height_mm(x, y) - smaller.height_mm(x, y)) / (2 * h), 1e-8);
    const Eigen::Vector3d numeric = (larger.on_surface(at) - smaller.on_surface(at)) / (2 * h);
    EXPECT_LT((Board::d_on_surface_d_scale(at) - numeric).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace crumple
