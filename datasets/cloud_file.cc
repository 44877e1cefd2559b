#include "datasets/cloud_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <istream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "datasets/output_folder.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::size_t offset = 0;
};

struct Header {
  std::size_t count = 0;
  std::size_t stride = 0;
  std::vector<Property> properties;
  std::size_t shares = 0;  // of the element behind the vertices, if that is one of shares
  std::string frame = "probe";
  std::vector<std::string> stations;
};

constexpr std::array<std::string_view, 6> covariance_names = {"cov_xx", "cov_xy", "cov_xz",
                                                              "cov_yy", "cov_yz", "cov_zz"};
constexpr std::array<std::array<int, 2>, 6> covariance_terms = {{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

constexpr std::string_view share_properties = "uint point;ushort view;float weight;";
constexpr std::size_t share_size = 10;

template <typename T>
void append(std::string& buffer, T value) {
  buffer.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

bool is_finite(const CloudPoint& point) {
  return point.position_mm.allFinite() && point.normal.allFinite() && point.covariance_mm2.allFinite() &&
         std::isfinite(point.intensity) && std::isfinite(point.sigma_mm) && std::isfinite(point.quality);
}

bool is_sound(const CloudShare& share, std::uint32_t point_before, std::size_t points) {
  return share.point >= point_before && share.point < points && std::isfinite(share.weight);
}

Expected<void> check_cloud(const Cloud& cloud) {
  for (const std::string& text : cloud.stations)
    if (text.find_first_of("\r\n") != std::string::npos) return fail("a station's id holds a line break");
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (!is_finite(cloud.points[i])) return fail(fmt::format("point {} has a number that is not finite", i));
  for (std::size_t i = 0; i < cloud.shares.size(); ++i)
    if (!is_sound(cloud.shares[i], i == 0 ? 0 : cloud.shares[i - 1].point, cloud.points.size()))
      return fail(fmt::format("share {} is of no point or out of order", i));
  for (const CloudColumn& column : cloud.columns) {
    if (!is_plain_name(column.name)) return fail(fmt::format("`{}` is no name for a property", column.name));
    if (column.values.size() != cloud.points.size()) return fail(fmt::format("{} is not of every point", column.name));
    for (const float value : column.values)
      if (!std::isfinite(value)) return fail(fmt::format("{} has a number that is not finite", column.name));
  }
  return {};
}

std::string header_text(const Cloud& cloud) {
  std::string text =
      fmt::format("ply\nformat binary_little_endian 1.0\ncomment crumple-cloud/2\ncomment frame {}\ncomment units mm\n",
                  cloud.frame);
  for (std::size_t i = 0; i < cloud.stations.size(); ++i)
    text += fmt::format("comment station {} {}\n", i, cloud.stations[i]);
  text += fmt::format("element vertex {}\n", cloud.points.size());
  for (const char* const name : {"x", "y", "z"}) text += fmt::format("property double {}\n", name);
  for (const char* const name : {"nx", "ny", "nz", "intensity", "sigma_mm"})
    text += fmt::format("property float {}\n", name);
  for (const std::string_view name : covariance_names) text += fmt::format("property float {}\n", name);
  text += "property ushort station\nproperty float quality\nproperty ushort view\n";
  for (const CloudColumn& column : cloud.columns) text += fmt::format("property float {}\n", column.name);
  if (!cloud.shares.empty()) {
    text += fmt::format("element share {}\n", cloud.shares.size());
    text += "property uint point\nproperty ushort view\nproperty float weight\n";
  }
  return text + "end_header\n";
}

void append_point(std::string& buffer, const CloudPoint& point) {
  for (const double value : point.position_mm) append(buffer, value);
  for (const float value : point.normal) append(buffer, value);
  append(buffer, point.intensity);
  append(buffer, point.sigma_mm);
  for (const auto& [row, column] : covariance_terms) append(buffer, point.covariance_mm2(row, column));
  append(buffer, point.station);
  append(buffer, point.quality);
  append(buffer, point.view);
}

std::optional<Scalar> scalar_type(const std::string& name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> names = {{{"char", "int8"},
                                                                     {"uchar", "uint8"},
                                                                     {"short", "int16"},
                                                                     {"ushort", "uint16"},
                                                                     {"int", "int32"},
                                                                     {"uint", "uint32"},
                                                                     {"float", "float32"},
                                                                     {"double", "float64"}}};
  for (std::size_t i = 0; i < names.size(); ++i)
    if (name == names[i][0] || name == names[i][1]) return static_cast<Scalar>(i);
  return std::nullopt;
}

std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> sizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

template <typename T>
double load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

double load(Scalar type, const char* bytes) {
  switch (type) {
    case Scalar::int8:
      return load<std::int8_t>(bytes);
    case Scalar::uint8:
      return load<std::uint8_t>(bytes);
    case Scalar::int16:
      return load<std::int16_t>(bytes);
    case Scalar::uint16:
      return load<std::uint16_t>(bytes);
    case Scalar::int32:
      return load<std::int32_t>(bytes);
    case Scalar::uint32:
      return load<std::uint32_t>(bytes);
    case Scalar::float32:
      return load<float>(bytes);
    case Scalar::float64:
      return load<double>(bytes);
  }
  return 0;
}

std::string rest_of(std::istringstream& words) {
  std::string rest;
  std::getline(words >> std::ws, rest);
  return rest;
}

Expected<void> read_comment(std::istringstream& words, Header& header) {
  std::string key;
  words >> key;
  if (key == "frame") header.frame = rest_of(words);
  std::size_t index = 0;
  if (key == "station" && words >> index) {
    if (index != header.stations.size()) return fail("the comments that name its stations are out of order");
    header.stations.push_back(rest_of(words));
  }
  return {};
}

Expected<void> read_property(std::istringstream& words, Header& header) {
  std::string type, name;
  words >> type >> name;
  const auto scalar = scalar_type(type);
  if (!scalar) return fail(fmt::format("its vertex property '{} {}' is not a plain number", type, name));
  header.properties.push_back({name, *scalar, header.stride});
  header.stride += size_of(*scalar);
  return {};
}

Expected<Header> read_header(std::istream& stream) {
  Header header;
  std::string line, element, share_text;
  if (!std::getline(stream, line) || (line != "ply" && line != "ply\r")) return fail("it is not a PLY file");
  for (int count = 0; count < 100000 && std::getline(stream, line); ++count) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line == "end_header" && header.shares > 0 && share_text != share_properties)
      return fail("its shares are not uint point, ushort view and float weight");
    if (line == "end_header") return header;
    std::istringstream words(line);
    std::string keyword, word;
    words >> keyword;
    Expected<void> taken;
    if (keyword == "format" && words >> word && word != "binary_little_endian")
      return fail(fmt::format("its format is {}; binary_little_endian can be read", word));
    if (keyword == "comment") taken = read_comment(words, header);
    if (keyword == "element") {
      std::size_t count_of_it = 0;
      const std::string before = std::exchange(element, "");
      words >> element >> count_of_it;
      if (before.empty() && (element != "vertex" || !words))
        return fail("its first element is not 'vertex' with a count");
      if (before.empty()) header.count = count_of_it;
      const bool behind = before == "vertex" && element == "share";
      if (!before.empty() && !behind) element = "other";
      if (behind) header.shares = count_of_it;
    }
    if (keyword == "property" && element == "vertex") taken = read_property(words, header);
    if (keyword == "property" && element == "share") share_text += rest_of(words) + ";";
    if (!taken) return tl::unexpected(taken.error());
  }
  return fail("its header does not end");
}

// Reads a property of a vertex, or `otherwise` where the file does not have it.
class Column {
 public:
  Column(const Header& header, std::string_view name, double otherwise = 0) : otherwise_(otherwise) {
    const auto found = std::find_if(header.properties.begin(), header.properties.end(),
                                    [&](const Property& property) { return property.name == name; });
    if (found != header.properties.end()) property_ = *found;
  }
  bool exists() const { return property_.has_value(); }
  double operator()(const char* vertex) const {
    return property_ ? load(property_->type, vertex + property_->offset) : otherwise_;
  }
  float real(const char* vertex) const { return static_cast<float>((*this)(vertex)); }

 private:
  std::optional<Property> property_;
  double otherwise_;
};

class PointReader {
 public:
  explicit PointReader(const Header& header)
      : position_{Column(header, "x"), Column(header, "y"), Column(header, "z")},
        normal_{Column(header, "nx"), Column(header, "ny"), Column(header, "nz")},
        intensity_(header, "intensity"),
        sigma_mm_(header, "sigma_mm"),
        station_(header, "station"),
        quality_(header, "quality"),
        view_(header, "view") {
    for (const std::string_view name : covariance_names) covariance_.emplace_back(header, name);
  }

  bool has_positions() const { return position_[0].exists() && position_[1].exists() && position_[2].exists(); }

  // No value where a number is not finite.
  std::optional<CloudPoint> operator()(const char* vertex) const {
    CloudPoint point;
    point.position_mm = {position_[0](vertex), position_[1](vertex), position_[2](vertex)};
    point.normal = {normal_[0].real(vertex), normal_[1].real(vertex), normal_[2].real(vertex)};
    point.intensity = intensity_.real(vertex);
    point.sigma_mm = sigma_mm_.real(vertex);
    for (std::size_t i = 0; i < covariance_terms.size(); ++i) {
      const auto [row, column] = covariance_terms[i];
      point.covariance_mm2(row, column) = point.covariance_mm2(column, row) = covariance_[i].real(vertex);
    }
    point.quality = quality_.real(vertex);
    const double station = station_(vertex), view = view_(vertex);
    if (!std::isfinite(station) || !std::isfinite(view) || !is_finite(point)) return std::nullopt;
    point.station = static_cast<std::uint16_t>(std::clamp(station, 0.0, 65535.0));
    point.view = static_cast<std::uint16_t>(std::clamp(view, 0.0, 65535.0));
    return point;
  }

 private:
  std::array<Column, 3> position_, normal_;
  Column intensity_, sigma_mm_, station_, quality_, view_;
  std::vector<Column> covariance_;
};

Expected<void> read_shares(std::istream& stream, std::uintmax_t file_size, std::size_t count, Cloud& cloud) {
  if (count > file_size / share_size) return fail("it is cut short");
  cloud.shares.reserve(count);
  std::array<char, share_size> bytes{};
  for (std::size_t i = 0; i < count; ++i) {
    if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return fail("it is cut short");
    CloudShare share;
    std::memcpy(&share.point, bytes.data(), sizeof(share.point));
    std::memcpy(&share.view, bytes.data() + 4, sizeof(share.view));
    std::memcpy(&share.weight, bytes.data() + 6, sizeof(share.weight));
    if (!is_sound(share, i == 0 ? 0 : cloud.shares.back().point, cloud.points.size()))
      return fail(fmt::format("share {} is of no point or out of order", i));
    cloud.shares.push_back(share);
  }
  return {};
}

Expected<Cloud> read_points(std::istream& stream, std::uintmax_t file_size, const Header& header) {
  const PointReader reader(header);
  if (!reader.has_positions()) return fail("its vertices have no x, y and z");
  if (header.count > file_size / header.stride) return fail("it is cut short");
  Cloud cloud{header.frame, header.stations, {}};
  cloud.points.reserve(header.count);
  std::string vertex(header.stride, '\0');
  for (std::size_t i = 0; i < header.count; ++i) {
    if (!stream.read(vertex.data(), static_cast<std::streamsize>(vertex.size()))) return fail("it is cut short");
    const auto point = reader(vertex.data());
    if (!point) return fail(fmt::format("point {} has a number that is not finite", i));
    if (!cloud.stations.empty() && point->station >= cloud.stations.size())
      return fail(fmt::format("point {} belongs to station {}, which has no name", i, point->station));
    cloud.points.push_back(*point);
  }
  if (auto done = read_shares(stream, file_size, header.shares, cloud); !done) return tl::unexpected(done.error());
  return cloud;
}

}  // namespace

Expected<void> write_cloud(const std::filesystem::path& file, const Cloud& cloud) {
  if (auto sound = check_cloud(cloud); !sound)
    return fail(fmt::format("{} was not written: {}.", file.string(), sound.error().message));
  return write_file(file, [&](std::ostream& stream) {
    stream << header_text(cloud);
    std::string buffer;
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      append_point(buffer, cloud.points[i]);
      for (const CloudColumn& column : cloud.columns) append(buffer, column.values[i]);
      if (buffer.size() < (1U << 20)) continue;
      stream << buffer;
      buffer.clear();
    }
    for (const CloudShare& share : cloud.shares) {
      append(buffer, share.point);
      append(buffer, share.view);
      append(buffer, share.weight);
    }
    stream << buffer;
  });
}

Expected<Cloud> read_cloud(std::istream& stream, std::uintmax_t size) {
  const auto header = read_header(stream);
  return header ? read_points(stream, size, *header) : tl::unexpected(header.error());
}

Expected<Cloud> read_cloud(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream)
    return fail(fmt::format("{} could not be read: {}.", file.string(), error ? error.message() : "no access"));
  auto cloud = read_cloud(stream, size);
  if (!cloud) return fail(fmt::format("{}: {}", file.string(), cloud.error().message));
  return cloud;
}

}  // namespace crumple
