#include "datasets/residuals_file.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

#include <fmt/format.h>

namespace crumple {
namespace {

// Files that Crumple wrote before it told redundancies end here.
constexpr const char* kEarlierHeader =
    "placement,camera,sensor,kind,index,x_px,y_px,residual_1_px,residual_2_px,accepted";
constexpr std::size_t kEarlierFields = 10;
constexpr const char* kMore = ",redundancy,standardised_residual";
constexpr std::size_t kFields = 12;

// A field of RFC 4180.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool escaped = quoted && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"';
    if (escaped) {
      fields.back() += line[++i];
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (line[i] == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  return fields;
}

template <typename Number>
std::optional<Number> parsed_number(const std::string& text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

// One corner into the view it belongs to; false where the line cannot be read.
bool add_corner(const std::vector<std::string>& fields, std::vector<RecordedCorners>& views) {
  const auto index = parsed_number<int>(fields[4]);
  const auto x = parsed_number<double>(fields[5]), y = parsed_number<double>(fields[6]);
  const auto dx = parsed_number<double>(fields[7]), dy = parsed_number<double>(fields[8]);
  const auto accepted = parsed_number<int>(fields[9]);
  if (!index || !x || !y || !dx || !dy || !accepted) return false;
  if (views.empty() || views.back().placement != fields[0] || views.back().camera != fields[1]) {
    views.push_back({fields[0], fields[1], {}, {}, {}, {}});
  }
  RecordedCorners& view = views.back();
  view.corners.push_back(*index);
  view.pixels.emplace_back(*x, *y);
  view.residuals_px.emplace_back(*dx, *dy);
  view.accepted.push_back(*accepted != 0);
  return true;
}

// Where the observations of a view lie: their camera, its pixels, and the marked points of a board's view.
struct SeenAt {
  std::size_t camera;
  const std::vector<Eigen::Vector2d>& pixels;
  const std::vector<int>* corners;
};

// In the order of make_views, as BundleResult::views.
std::vector<SeenAt> places(const Observations& observations) {
  std::vector<SeenAt> all;
  for (const CornerView& view : observations.corners) all.push_back({view.sensor, view.pixels, &view.corners});
  for (const StripeView& view : observations.stripes) all.push_back({view.camera, view.camera_pixels, nullptr});
  for (const FeatureView& view : observations.features) all.push_back({view.camera, view.camera_pixels, nullptr});
  for (const LedView& view : observations.leds) all.push_back({view.sensor, view.pixels, nullptr});
  return all;
}

}  // namespace

std::string residuals_csv(const Calibration& calibration, const Observations& observations) {
  std::string text = std::string(kEarlierHeader) + kMore + "\n";
  const std::vector<Sensor>& sensors = calibration.bundle.state.rig.sensors;
  const std::vector<SeenAt> seen = places(observations);
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const ViewSummary& view = calibration.bundle.views[v];
    const Eigen::Index dimension = View::dimension_of(view.kind);
    for (std::size_t i = 0; i < seen[v].pixels.size(); ++i) {
      const Eigen::Index row = dimension * static_cast<Eigen::Index>(i);
      const bool accepted = view.inlier[i] != 0;
      const std::string second = dimension == 2 ? fmt::format("{}", view.residuals_px[row + 1]) : "";
      const std::string redundancy = accepted ? fmt::format("{}", view.redundancy[i]) : "";
      text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", field(place_name(calibration, view)),
                          sensors[seen[v].camera].name, sensors[view.sensor].name, name_of(view.kind),
                          seen[v].corners != nullptr ? (*seen[v].corners)[i] : static_cast<int>(i),
                          seen[v].pixels[i].x(), seen[v].pixels[i].y(), view.residuals_px[row], second,
                          accepted ? 1 : 0, redundancy, view.standardised[i]);
    }
  }
  return text;
}

Expected<std::vector<RecordedCorners>> parse_recorded_corners(const std::string& csv, const std::string& file_name) {
  std::istringstream lines(csv);
  std::string line;
  const std::string header = std::string(kEarlierHeader) + kMore;
  if (!std::getline(lines, line) || (line != header && line != kEarlierHeader)) {
    return fail(fmt::format("{}:1: the header has to be {}", file_name, header));
  }
  const std::size_t expected = line == header ? kFields : kEarlierFields;
  std::vector<RecordedCorners> views;
  for (int number = 2; std::getline(lines, line); ++number) {
    const std::vector<std::string> fields = fields_of(line);
    if (fields.size() != expected) {
      return fail(fmt::format("{}:{}: has {} fields, not {}", file_name, number, fields.size(), expected));
    }
    if (fields[3] == name_of(View::Kind::corners) && !add_corner(fields, views)) {
      return fail(fmt::format("{}:{}: holds a number that cannot be read", file_name, number));
    }
  }
  return views;
}

}  // namespace crumple
