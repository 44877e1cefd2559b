#include "datasets/yaml_values.h"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <tuple>
#include <vector>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr int kLargestSide = 65500;

std::pair<int, int> integer_pair(const YamlValue& value, const std::string& what, int lowest, int highest) {
  const std::vector<YamlValue> items = value.list();
  if (items.size() == 2) return {items[0].integer(lowest, highest), items[1].integer(lowest, highest)};
  value.problem("must hold two numbers, " + what);
  return {};
}

}  // namespace

double number_or(YamlMap& map, const std::string& key, double otherwise, double lowest, double highest) {
  const auto value = map.find(key);
  return value ? value->number(lowest, highest) : otherwise;
}

double required_number(YamlMap& map, const std::string& key, const std::string& what, double lowest, double highest) {
  const auto value = map.require(key, what);
  return value ? value->number(lowest, highest) : lowest;
}

template <int N>
Eigen::Matrix<double, N, 1> read_vector(const YamlValue& value, double lowest, double highest) {
  Eigen::Matrix<double, N, 1> numbers = Eigen::Matrix<double, N, 1>::Zero();
  const std::vector<YamlValue> items = value.list();
  if (items.size() != N) {
    value.problem(fmt::format("must hold {} numbers", N));
    return numbers;
  }
  for (int i = 0; i < N; ++i) numbers[i] = items[static_cast<std::size_t>(i)].number(lowest, highest);
  return numbers;
}

template Eigen::Vector2d read_vector<2>(const YamlValue&, double, double);
template Eigen::Vector3d read_vector<3>(const YamlValue&, double, double);
template Eigen::Vector4d read_vector<4>(const YamlValue&, double, double);

bool is_plain_name(const std::string& name) {
  return !name.empty() && name.size() <= 100 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
}

bool is_station_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return c >= 0x20 && c != '/' && c != '\\'; });
}

ImageSize read_size_px(YamlMap& map) {
  const auto size = map.require("size_px", "[width, height]");
  if (!size) return {};
  const auto [width, height] = integer_pair(*size, "[width, height]", 1, kLargestSide);
  return {width, height};
}

std::pair<int, int> read_inner_corners(YamlMap& map) {
  const auto corners = map.require("inner_corners", "[columns, rows], counted where four squares meet");
  if (!corners) return {};
  const auto [columns, rows] = integer_pair(*corners, "[columns, rows]", 3, 200);
  return {columns, rows};
}

std::pair<int, int> read_columns_and_rows(YamlMap& map, const std::string& key, int lowest) {
  const auto counts = map.require(key, "[columns, rows]");
  if (!counts) return {};
  return integer_pair(*counts, "[columns, rows]", lowest, 200);
}

StripeOrientation read_orientation(const YamlValue& value, const std::optional<ImageSize>& panel) {
  YamlMap map = value.map();
  StripeOrientation orientation;
  if (const auto angle = map.require("angle_deg", "of the stripes' normal: 0 for columns, 90 for rows")) {
    orientation.angle_rad = angle->number(-360, 360) * std::numbers::pi / 180;
  }
  if (const auto width = map.require("stripe_width_px", "of the finest stripes, in projector pixels")) {
    orientation.stripe_width_px = width->positive_number();
  }
  if (const auto bits = map.require("bits", "the number of patterns")) orientation.bits = bits->integer(1, 16);
  if (const auto offset = map.find("code_offset")) orientation.code_offset = offset->integer(0, 65535);
  if (const auto inverse = map.find("inverse")) orientation.inverse = inverse->boolean();
  map.finish();
  if (panel) {
    const auto sound = checked(orientation, *panel);
    if (!sound) value.problem(sound.error().message);
  }
  return orientation;
}

ProjectedChessboard read_projected_chessboard(const YamlValue& value, const std::optional<ImageSize>& panel) {
  YamlMap map = value.map();
  ProjectedChessboard board;
  std::tie(board.columns, board.rows) = read_inner_corners(map);
  if (const auto first = map.require("first_corner_px", "[x, y] of the first inner corner on the panel")) {
    board.first_corner_px = read_vector<2>(*first, 0, kLargestSide);
  }
  if (const auto pitch = map.require("pitch_px", "the distance between neighbouring corners on the panel")) {
    board.pitch_px = pitch->positive_number();
  }
  map.finish();
  const double last_x = board.first_corner_px.x() + (board.columns - 1) * board.pitch_px;
  const double last_y = board.first_corner_px.y() + (board.rows - 1) * board.pitch_px;
  if (panel && (last_x > panel->width_px - 1 || last_y > panel->height_px - 1)) {
    value.problem(fmt::format("the last corner ({:g}, {:g}) lies outside the {} x {} panel", last_x, last_y,
                              panel->width_px, panel->height_px));
  }
  return board;
}

}  // namespace crumple
