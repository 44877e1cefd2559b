#include "datasets/report/volume_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "datasets/report/html.h"

namespace crumple {
namespace {

// Points of one depth, measured from one station.
struct Layer {
  std::array<double, 3> squares_mm2{};  // in the middle of the image, at its edges, in its corners
  std::array<double, 3> points{};
  double worst_mm = 0;

  void add(const VolumePoint& point) {
    const auto place = static_cast<std::size_t>((point.column == 1 ? 0 : 1) + (point.row == 1 ? 0 : 1));
    const double square_mm2 = point.covariance_mm2.trace();
    squares_mm2[place] += square_mm2;
    ++points[place];
    worst_mm = std::max(worst_mm, std::sqrt(square_mm2));
  }
  std::string u(std::size_t place) const {
    if (points[place] == 0) return "";
    const double u_mm = std::sqrt(squares_mm2[place] / points[place]);
    return html_uncertainty(u_mm);
  }
};

std::string coverage_words(const VolumeCoverage& covered, const Calibration& calibration) {
  return fmt::format(
      "<p>Boards stood in {} of the {} parts of the volume before {}: thirds of its image, and of the depth from {} to "
      "{} mm.{}</p>\n",
      html_number(covered.covered(), 0), covered.corners.size(),
      html_text(calibration.bundle.state.rig.sensors[covered.camera].name), html_number(covered.near_mm, 0),
      html_number(covered.far_mm, 0), covered.shallow() ? " Nearer and farther everything is extrapolated." : "");
}

std::string points_table(const VolumePoints& volume, const Calibration& calibration) {
  std::map<std::pair<double, std::size_t>, Layer> layers;
  for (const VolumePoint& point : volume.points) layers[{point.depth_mm, point.station.value_or(0)}].add(point);
  const bool posed_by_leds = volume.points.front().station.has_value();
  std::vector<std::vector<std::string>> rows;
  for (const auto& [at, layer] : layers) {
    std::vector<std::string> row{html_number(at.first, 0)};
    if (posed_by_leds) row.push_back(html_text(calibration.station_names[at.second]));
    for (std::size_t place = 0; place < 3; ++place) row.push_back(layer.u(place));
    row.push_back(html_uncertainty(layer.worst_mm));
    rows.push_back(std::move(row));
  }
  std::vector<HtmlColumn> columns{{"Depth, mm"}};
  if (posed_by_leds) columns.push_back({"Station", true});
  columns.insert(columns.end(), {{"Middle, mm"}, {"Edges, mm"}, {"Corners, mm"}, {"Worst, mm"}});
  const std::string& camera = calibration.bundle.state.rig.sensors[volume.camera].name;
  return fmt::format(
             "<p>Standard uncertainty of a point "
             "(root of its three variances) that the calibration leaves, with respect to {}. Points are "
             "the middles of the thirds of {}'s image at the nearest and the farthest board, measured by all that see "
             "them{}. {} The readings' own noise is not in it.</p>\n",
             volume.frame == Mount::world ? "the boards and LEDs that its trackers saw" : "the boards that it saw",
             html_text(camera), posed_by_leds ? ", the probe posed by its LEDs" : "",
             calibration.scale ? "The scale's uncertainty is in it."
                               : "The scale's uncertainty is unknown and not in it.") +
         html_table(columns, rows);
}

}  // namespace

std::string volume_section(const CalibrationFigures& figures, const Calibration& calibration) {
  std::string html = "<section id=\"volume\">\n<h2>Points in the measuring volume</h2>\n";
  if (figures.covered) html += coverage_words(*figures.covered, calibration);
  html += figures.volume ? points_table(*figures.volume, calibration)
                         : "<p>No point of it is measured by two sensors.</p>\n";
  return html + "</section>\n";
}

}  // namespace crumple
