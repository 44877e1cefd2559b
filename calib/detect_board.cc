#include "calib/detect_board.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/grey_image.h"
#include "calib/refine_corner.h"
#include "calib/seeded_dice.h"

namespace crumple {
namespace {

// Fewer corners than this along one direction are no board to rely on.
constexpr int kMinimumAlong = 4;

// Corners in rows, as found; element (row, column).
struct Grid {
  int columns = 0;
  int rows = 0;
  std::vector<Eigen::Vector2d> pixels;

  const Eigen::Vector2d& at(int row, int column) const {
    return pixels[static_cast<std::size_t>(row * columns + column)];
  }
};

Grid transposed(const Grid& grid) {
  Grid result{grid.rows, grid.columns, {}};
  for (int column = 0; column < grid.columns; ++column) {
    for (int row = 0; row < grid.rows; ++row) result.pixels.push_back(grid.at(row, column));
  }
  return result;
}

Grid mirrored(const Grid& grid) {
  Grid result{grid.columns, grid.rows, {}};
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = grid.columns - 1; column >= 0; --column) result.pixels.push_back(grid.at(row, column));
  }
  return result;
}

Grid turned(Grid grid) {
  std::reverse(grid.pixels.begin(), grid.pixels.end());
  return grid;
}

Eigen::Vector2d mean_step_x(const Grid& grid) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int row = 0; row < grid.rows; ++row) sum += grid.at(row, grid.columns - 1) - grid.at(row, 0);
  return sum / (grid.rows * (grid.columns - 1));
}

Eigen::Vector2d mean_step_y(const Grid& grid) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int column = 0; column < grid.columns; ++column) sum += grid.at(grid.rows - 1, column) - grid.at(0, column);
  return sum / (grid.columns * (grid.rows - 1));
}

// What OpenCV's detector is asked for.
struct Search {
  int columns;
  int rows;
  int flags;
  std::uint64_t seed;
};

std::optional<Grid> find_grid(const cv::Mat& image8, const Search& search) {
  const SeededDice dice(search.seed);
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(image8, {search.columns, search.rows}, corners, search.flags, meta))
    return std::nullopt;
  Grid grid{meta.cols, meta.rows, {}};
  if (static_cast<std::size_t>(grid.columns * grid.rows) != corners.size()) return std::nullopt;
  for (const cv::Point2f& c : corners) grid.pixels.emplace_back(c.x, c.y);
  return grid;
}

double intensity(const cv::Mat& image8, const Eigen::Vector2d& pixel) {
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), 1, image8.cols - 2);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), 1, image8.rows - 2);
  return cv::mean(image8(cv::Rect(x - 1, y - 1, 3, 3)))[0];
}

bool inside(const cv::Mat& image, const Eigen::Vector2d& pixel, double margin_px) {
  return pixel.x() > margin_px && pixel.y() > margin_px && pixel.x() < image.cols - 1 - margin_px &&
         pixel.y() < image.rows - 1 - margin_px;
}

// The step to the next corner along the rows (or columns), where there is one on either side by central difference.
Eigen::Vector2d step_at(const Grid& grid, int row, int column, int along_row, int along_column) {
  const auto clamped = [&](int sign) -> const Eigen::Vector2d& {
    return grid.at(std::clamp(row + sign * along_row, 0, grid.rows - 1),
                   std::clamp(column + sign * along_column, 0, grid.columns - 1));
  };
  const int last = along_row != 0 ? grid.rows - 1 : grid.columns - 1;
  const int index = along_row != 0 ? row : column;
  return (clamped(1) - clamped(-1)) / (index == 0 || index == last ? 1 : 2);
}

// Whether the squares about a corner are dark and light in turns, by a good part of their contrast. Beyond a board's
// rim there are no squares, and two of the four are alike. Close to the corner, for the outermost squares of some
// prints are cut.
bool is_crossing(const cv::Mat& image8, const Grid& grid, int row, int column) {
  const Eigen::Vector2d along = 0.3 * step_at(grid, row, column, 0, 1), across = 0.3 * step_at(grid, row, column, 1, 0);
  for (const int x : {-1, 1}) {
    for (const int y : {-1, 1}) {
      if (!inside(image8, grid.at(row, column) + x * along + y * across, 1)) return true;  // it cannot be told
    }
  }
  const auto square = [&](int x, int y) { return intensity(image8, grid.at(row, column) + x * along + y * across); };
  const double a = square(-1, -1), b = square(1, 1), c = square(1, -1), d = square(-1, 1);
  const double gap = std::max(std::min(a, b) - std::max(c, d), std::min(c, d) - std::max(a, b));
  return gap > 0.25 * (std::max({a, b, c, d}) - std::min({a, b, c, d}));
}

// OpenCV's detector takes a board's rim for a row of corners now and then, and leaves out the row at the other end.
bool reaches_over_the_rim(const cv::Mat& image8, const Grid& grid) {
  const auto mostly_none = [&](int count, const auto& crossing) {
    int crossings = 0;
    for (int i = 0; i < count; ++i) crossings += crossing(i) ? 1 : 0;
    return 2 * crossings < count;
  };
  for (const int row : {0, grid.rows - 1}) {
    if (mostly_none(grid.columns, [&](int i) { return is_crossing(image8, grid, row, i); })) return true;
  }
  for (const int column : {0, grid.columns - 1}) {
    if (mostly_none(grid.rows, [&](int i) { return is_crossing(image8, grid, i, column); })) return true;
  }
  return false;
}

// Whether the square between corner (0,0) and (1,1) is dark, by the majority of all squares inside the grid.
bool first_square_dark(const cv::Mat& image8, const Grid& grid) {
  int votes = 0;
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + 2 < grid.columns; ++column) {
      const auto centre = [&](int c) {
        return Eigen::Vector2d(0.25 *
                               (grid.at(row, c) + grid.at(row, c + 1) + grid.at(row + 1, c) + grid.at(row + 1, c + 1)));
      };
      const bool darker = intensity(image8, centre(column)) < intensity(image8, centre(column + 1));
      votes += darker == ((row + column) % 2 == 0) ? 1 : -1;
    }
  }
  return votes > 0;
}

// Where a grid of `found` corners starts among `all` along one direction; the ends tell whether the next corners
// beyond the first and the last would still lie in the image.
Expected<int> start_along(int found, int all, bool first_end_in_image, bool last_end_in_image) {
  if (found == all) return 0;
  if (first_end_in_image == last_end_in_image) {
    return fail(
        "only part of the board is visible and it cannot be told which, for it has no markers: show it whole, or cut "
        "off by the image's border at one end only");
  }
  return first_end_in_image ? 0 : all - found;
}

// Whether the corners one step beyond an end, extrapolated, all lie in the image, with the half square about them that
// the detector needs to see.
template <typename Beyond>
bool all_inside(const cv::Mat& image, int count, double margin_px, const Beyond& beyond) {
  for (int i = 0; i < count; ++i) {
    if (!inside(image, beyond(i), margin_px)) return false;
  }
  return true;
}

struct Start {
  int column = 0;
  int row = 0;
};

Expected<Start> start_of(const cv::Mat& image8, const Grid& grid, int columns, int rows) {
  const int last_column = grid.columns - 1, last_row = grid.rows - 1;
  const double margin_px = 0.5 * std::max(mean_step_x(grid).norm(), mean_step_y(grid).norm());
  const auto beyond = [&](int row, int column, int inner_row, int inner_column) {
    return Eigen::Vector2d(2 * grid.at(row, column) - grid.at(inner_row, inner_column));
  };
  const auto column = start_along(
      grid.columns, columns, all_inside(image8, grid.rows, margin_px, [&](int i) { return beyond(i, 0, i, 1); }),
      all_inside(image8, grid.rows, margin_px, [&](int i) { return beyond(i, last_column, i, last_column - 1); }));
  if (!column) return tl::unexpected(column.error());
  const auto row = start_along(
      grid.rows, rows, all_inside(image8, grid.columns, margin_px, [&](int i) { return beyond(0, i, 1, i); }),
      all_inside(image8, grid.columns, margin_px, [&](int i) { return beyond(last_row, i, last_row - 1, i); }));
  if (!row) return tl::unexpected(row.error());
  return Start{*column, *row};
}

struct Placement {
  Grid grid;
  Start start;  // the board's column and row of the grid's first corner
};

// Of the grid and the grid after half a turn, the one that fits the board (see the header).
Expected<Placement> place(const cv::Mat& image8, const Grid& upright, int columns, int rows) {
  const bool ends_differ = (columns + rows) % 2 == 1;
  const Grid half_turn = turned(upright);
  const bool swap = ends_differ ? false : mean_step_x(upright).x() < 0;
  Grid grid = swap ? half_turn : upright;
  auto start = start_of(image8, grid, columns, rows);
  if (!start) return tl::unexpected(start.error());
  // Along the diagonal, the square outside corner 0 and the first inside it have one colour.
  if (ends_differ && first_square_dark(image8, grid) != ((start->column + start->row) % 2 == 0)) {
    grid = half_turn;
    start = start_of(image8, grid, columns, rows);
    if (!start) return tl::unexpected(start.error());
  }
  return Placement{grid, *start};
}

DetectedBoard refined(const cv::Mat& image, const Placement& placement, int board_columns) {
  const Grid& grid = placement.grid;
  DetectedBoard board;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const auto corner = refine_corner(image, grid.at(row, column), step_at(grid, row, column, 0, 1),
                                        step_at(grid, row, column, 1, 0));
      if (!corner) {
        ++board.unrefined;
        continue;
      }
      board.corners.push_back((row + placement.start.row) * board_columns + column + placement.start.column);
      board.pixels.push_back(corner->pixel);
    }
  }
  return board;
}

// Which way round a found grid is: its rows along the board's, x cross y into the board.
std::optional<Grid> aligned(Grid grid, int columns, int rows) {
  const bool fits = grid.columns <= columns && grid.rows <= rows;
  const bool fits_transposed = grid.rows <= columns && grid.columns <= rows;
  if (fits == fits_transposed && grid.columns != columns && grid.rows != rows) return std::nullopt;
  if (!fits) {
    if (!fits_transposed) return std::nullopt;
    grid = transposed(grid);
  }
  const Eigen::Vector2d x = mean_step_x(grid), y = mean_step_y(grid);
  return x.x() * y.y() - x.y() * y.x() < 0 ? mirrored(grid) : grid;
}

// Of a board that is cut off in both directions: its rows and columns cannot even be told from each other.
bool may_be_part(const Grid& grid, int columns, int rows) {
  return std::max(grid.columns, grid.rows) <= std::max(columns, rows) &&
         std::min(grid.columns, grid.rows) <= std::min(columns, rows);
}

}  // namespace

Expected<DetectedBoard> detect_grid(const cv::Mat& image, int columns, int rows) {
  if (columns == rows)
    return fail("a square grid of corners looks the same from four sides: use one that is not square");
  const cv::Mat image8 = to_8_bit(image);
  // Each choice misses boards that the others find. Where the plain one finds the whole board it is much the fastest;
  // its corners are only where the search along the edges begins.
  constexpr int kPlain = 0;
  constexpr int kExhaustive = cv::CALIB_CB_ACCURACY | cv::CALIB_CB_EXHAUSTIVE;
  constexpr int kNormalised = cv::CALIB_CB_ACCURACY | cv::CALIB_CB_NORMALIZE_IMAGE;
  try {
    std::optional<Grid> grid;
    bool rim = false;
    // Whether what is found can be told to be the board or a part of it.
    const auto find = [&](const Search& search) {
      auto found = find_grid(image8, search);
      if (!found) return false;
      if (reaches_over_the_rim(image8, *found)) {
        rim = true;
        return false;
      }
      grid = std::move(found);
      return aligned(*grid, columns, rows).has_value();
    };
    bool placeable = find({columns, rows, kPlain, 1}) || find({columns, rows, kExhaustive, 1}) ||
                     find({columns, rows, kNormalised, 1});
    // A search may find but a part of the part that is seen, or the rim, and better with other dice.
    for (std::uint64_t seed = 1; seed <= 3 && !placeable && (seed == 1 || grid || rim); ++seed) {
      placeable = find({kMinimumAlong, kMinimumAlong, kExhaustive | cv::CALIB_CB_LARGER, seed});
    }
    if (!grid && rim) {
      return fail(
          "the outermost corners found have no dark and light squares about them: show the board's rim free of "
          "shadows, glare and whatever covers it");
    }
    if (!grid) {
      return fail(fmt::format(
          "no chessboard with {} x {} inner corners found: show it whole, or cut off by the image's border at one end "
          "only, for a part without markers cannot be told from another",
          columns, rows));
    }
    const auto upright = aligned(*grid, columns, rows);
    if (!upright && may_be_part(*grid, columns, rows)) {
      return fail(fmt::format(
          "{} x {} corners were found of the board's {} x {}, and it cannot be told which: it has no markers; "
          "show all of it along one direction at least",
          grid->columns, grid->rows, columns, rows));
    }
    if (!upright) {
      return fail(fmt::format("a grid of {} x {} corners was found where the board has {} x {}", grid->columns,
                              grid->rows, columns, rows));
    }
    const auto placement = place(image8, *upright, columns, rows);
    if (!placement) return tl::unexpected(placement.error());
    DetectedBoard board = refined(image, *placement, columns);
    if (2 * board.unrefined > static_cast<int>(upright->pixels.size())) {
      return fail(
          fmt::format("{} of the {} corners found do not look like crossing edges up close: the image is too "
                      "blurred, too coarse or too noisy",
                      board.unrefined, upright->pixels.size()));
    }
    return board;
  } catch (const cv::Exception& error) {
    return fail(fmt::format("the chessboard detector failed: {}", error.err));
  }
}

}  // namespace crumple
