#include "datasets/report/image_plots.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "datasets/round_number.h"

namespace crumple {
namespace {

constexpr int kWidth_px = 470;
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

// A drawing whose plotting area is the image, with room for labels, a colour bar and a line above.
Plot image_plot(ImageSize size, const std::string& commands) {
  constexpr double kLeft = 68, kRight = 106, kTop = 26, kBottom = 52;
  constexpr double kTallest = 520;
  double across = kWidth_px - kLeft - kRight;
  double down = across * size.height_px / size.width_px;
  if (down > kTallest) {
    across *= kTallest / down;
    down = kTallest;
  }
  const double height = down + kTop + kBottom;
  return {kWidth_px, static_cast<int>(std::lround(height)),
          fmt::format("set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n"
                      "set tmargin at screen {:.5f}\nset xrange [-0.5:{}]\nset yrange [{}:-0.5]\n"
                      "set xlabel 'x (px)' offset 0,0.6\nset ylabel 'y (px)' offset 1\nset tics out nomirror\n"
                      "set border lw 0.8\n{}",
                      kLeft / kWidth_px, (kLeft + across) / kWidth_px, kBottom / height, 1 - kTop / height,
                      size.width_px - 0.5, size.height_px - 0.5, commands)};
}

// Cividis, which reads the same with any colour vision and in grey (Nunez, Anderton & Renslow, PLOS ONE 2018).
constexpr const char* kPalette =
    "set palette defined (0 '#00224e', 0.125 '#123570', 0.25 '#3b496c', 0.375 '#575d6d', 0.5 '#707173', "
    "0.625 '#8a8678', 0.75 '#a59c74', 0.875 '#c3b369', 1 '#fee838')\n";

struct Arrow {
  Eigen::Vector2d from;
  Eigen::Vector2d length_px;
  bool accepted = true;
};

double root_mean_square(const std::vector<Arrow>& arrows) {
  double square = 0, count = 0;
  for (const Arrow& arrow : arrows) {
    if (!arrow.accepted) continue;
    square += arrow.length_px.squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(square / count) : 0;
}

// Enlarged so that their root mean square is at most this share of the image wide.
Plot arrow_plot(ImageSize size, const std::vector<Arrow>& arrows, double share) {
  const double usual_px = root_mean_square(arrows);
  if (!(usual_px > 0)) return image_plot(size, "set label 'no residuals' at graph 0.5,0.5 center\nplot NaN notitle\n");
  const double enlargement = largest_round_below(size.width_px * share / usual_px);
  const double key_px = largest_round_below(size.width_px / 8.0 / enlargement);
  std::vector<std::vector<double>> accepted, outliers;
  for (const Arrow& arrow : arrows) {
    const Eigen::Vector2d length = arrow.length_px * enlargement;
    (arrow.accepted ? accepted : outliers).push_back({arrow.from.x(), arrow.from.y(), length.x(), length.y()});
  }
  const double key_fraction = key_px * enlargement / size.width_px;
  std::string commands = gnuplot_data("accepted", accepted) + gnuplot_data("outliers", outliers);
  commands += fmt::format(
      "set arrow from graph {:.5f},1.045 to graph 1,1.045 head size graph 0.012,20 lw 1.2 lc rgb '#0072b2'\n"
      "set label '{:g} px' at graph {:.5f},1.045 right\n",
      1 - key_fraction, key_px, 0.985 - key_fraction);
  commands += "plot $accepted using 1:2:3:4 with vectors head size graph 0.012,20 lw 1 lc rgb '#0072b2' notitle";
  if (!outliers.empty()) {
    commands += ", $outliers using 1:2:3:4 with vectors head size graph 0.012,20 lw 1 lc rgb '#d55e00' notitle";
  }
  return image_plot(size, commands + "\n");
}

}  // namespace

Plot image_map_plot(ImageSize size, const ImageMap& map) {
  const double cell_x = static_cast<double>(size.width_px) / map.columns;
  const double cell_y = static_cast<double>(size.height_px) / map.rows;
  std::vector<std::vector<double>> rows;
  double largest = 0;
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    const auto column = static_cast<double>(static_cast<int>(i) % map.columns);
    const auto row = static_cast<double>(static_cast<int>(i) / map.columns);
    rows.push_back({(column + 0.5) * cell_x - 0.5, (row + 0.5) * cell_y - 0.5, map.values[i].value_or(kGap)});
    largest = std::max(largest, map.values[i].value_or(0));
  }
  return image_plot(
      size, gnuplot_data("map", rows) + kPalette +
                fmt::format("set cbrange [0:{:.6g}]\nset cblabel {}\nplot $map using 1:2:3 with image notitle\n",
                            largest > 0 ? largest : 1, gnuplot_text(map.label)));
}

Plot coverage_plot(ImageSize size, const ImageCells& cells) {
  ImageMap map{cells.columns, cells.rows, {}, "observations per cell"};
  for (const ImageCell& cell : cells.cells) {
    map.values.push_back(cell.observations > 0 ? std::optional(static_cast<double>(cell.observations)) : std::nullopt);
  }
  return image_map_plot(size, map);
}

Plot residual_sample_plot(ImageSize size, const std::vector<PlacedResidual>& residuals, std::size_t most) {
  std::vector<Arrow> arrows;
  const std::size_t count = std::min(residuals.size(), most);
  for (std::size_t i = 0; i < count; ++i) {
    const PlacedResidual& residual = residuals[i * residuals.size() / count];
    arrows.push_back({residual.pixel, residual.residual_px, residual.accepted});
  }
  return arrow_plot(size, arrows, 1.0 / 22);
}

Plot residual_field_plot(ImageSize size, const ImageCells& cells) {
  std::vector<Arrow> arrows;
  for (std::size_t c = 0; c < cells.cells.size(); ++c) {
    if (cells.cells[c].mean_px) arrows.push_back({cells.centre_px(c), *cells.cells[c].mean_px});
  }
  return arrow_plot(size, arrows, 1.0 / kLongSideCells);
}

}  // namespace crumple
