#include "datasets/pose_csv.h"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "datasets/limits.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

constexpr std::size_t kPoseFields = 8;
constexpr const char* kPoseColumns = "t, x, y, z, qx, qy, qz, qw";
constexpr double kPoseUnitLength = 1e-3;
constexpr double kMillimetres = 1000;

std::string_view trimmed(std::string_view text) {
  constexpr const char* blanks = " \t\r";
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<std::string_view> comma_separated(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0;;) {
    const std::size_t comma = line.find(',', begin);
    fields.push_back(trimmed(line.substr(begin, comma - begin)));
    if (comma == std::string_view::npos) return fields;
    begin = comma + 1;
  }
}

std::optional<double> number_in(std::string_view field) {
  double value = 0;
  const auto [end, failure] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (failure != std::errc() || end != field.data() + field.size()) return std::nullopt;
  if (!(std::abs(value) <= kLargestValue)) return std::nullopt;
  return value;
}

bool is_passed_over(std::string_view line, int number) {
  if (line.empty() || line.front() == '#') return true;
  return number == 1 && std::isalpha(static_cast<unsigned char>(line.front())) != 0;
}

// The error says what is wrong with the line, without its place.
Expected<StampedPose> pose_in(std::string_view line) {
  const std::vector<std::string_view> fields = comma_separated(line);
  if (fields.size() != kPoseFields) {
    return fail(fmt::format("has {} fields, not {}: {}", fields.size(), kPoseFields, kPoseColumns));
  }
  std::array<double, kPoseFields> v{};
  for (std::size_t i = 0; i < kPoseFields; ++i) {
    const auto value = number_in(fields[i]);
    if (!value) return fail(fmt::format("'{}' is no number of at most {:g}", fields[i], kLargestValue));
    v[i] = *value;
  }
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (!(std::abs(rotation.norm() - 1) <= kPoseUnitLength)) {
    return fail(
        fmt::format("the quaternion has the length {:.6g}, not 1; the columns are {}", rotation.norm(), kPoseColumns));
  }
  return StampedPose{v[0], {rotation.normalized(), kMillimetres * Eigen::Vector3d(v[1], v[2], v[3])}};
}

}  // namespace

Expected<std::vector<StampedPose>> parse_pose_csv(const std::string& csv, const std::string& file_name) {
  std::vector<StampedPose> poses;
  std::istringstream lines(csv);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view text = trimmed(line);
    if (is_passed_over(text, number)) continue;
    const auto pose = pose_in(text);
    if (!pose) return fail(fmt::format("{}:{}: {}", file_name, number, pose.error().message));
    if (!poses.empty() && pose->time_s < poses.back().time_s) {
      return fail(fmt::format("{}:{}: is older than the line before; sort the lines by time", file_name, number));
    }
    poses.push_back(*pose);
  }
  return poses;
}

Expected<PoseStream> read_pose_stream(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto poses = parse_pose_csv(*text, file.string());
  if (!poses) return tl::unexpected(poses.error());
  auto stream = PoseStream::create(*poses);
  if (!stream) return fail(fmt::format("{}: {}", file.string(), stream.error().message));
  return stream;
}

}  // namespace crumple
