#include "datasets/pose_csv.h"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
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

// The errors from here on say what is wrong with a line, without its place.
Expected<double> number_in(std::string_view field) {
  double value = 0;
  const auto [end, failure] = std::from_chars(field.data(), field.data() + field.size(), value);
  const bool whole = failure == std::errc() && end == field.data() + field.size();
  if (!whole || !(std::abs(value) <= kLargestValue)) {
    return fail(fmt::format("'{}' is no number of at most {:g}", field, kLargestValue));
  }
  return value;
}

// Place and quaternion of the seven fields behind the first.
Expected<Pose> pose_behind_first(const std::vector<std::string_view>& fields, double unit_mm, const char* columns) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = number_in(fields[i + 1]);
    if (!value) return tl::unexpected(value.error());
    v[i] = *value;
  }
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (!(std::abs(rotation.norm() - 1) <= kPoseUnitLength)) {
    return fail(
        fmt::format("the quaternion has the length {:.6g}, not 1; the columns are {}", rotation.norm(), columns));
  }
  return Pose{rotation.normalized(), unit_mm * Eigen::Vector3d(v[0], v[1], v[2])};
}

Expected<StampedPose> pose_in(std::string_view line) {
  const std::vector<std::string_view> fields = comma_separated(line);
  if (fields.size() != kPoseFields) {
    return fail(fmt::format("has {} fields, not {}: {}", fields.size(), kPoseFields, kPoseColumns));
  }
  const auto time_s = number_in(fields.front());
  if (!time_s) return tl::unexpected(time_s.error());
  const auto pose = pose_behind_first(fields, kMillimetres, kPoseColumns);
  if (!pose) return tl::unexpected(pose.error());
  return StampedPose{*time_s, *pose};
}

// Of poses.csv, whose lines have as many fields as its first one.
Expected<Pose> station_pose_in(std::string_view line, std::size_t columns) {
  const std::vector<std::string_view> fields = comma_separated(line);
  if (fields.size() != columns) return fail(fmt::format("has {} fields, the first line {}", fields.size(), columns));
  return pose_behind_first(fields, 1, kStationPoseColumns);
}

bool is_of_stations(const std::string& csv) { return csv.starts_with(kStationPoseColumns); }

bool names_columns(std::string_view line, int number) {
  return number == 1 && std::isalpha(static_cast<unsigned char>(line.front())) != 0;
}

// Hands every line that is not empty, with its number from 1, to `take`. Stops where that fails and adds the place.
Expected<void> take_lines(const std::string& csv, const std::string& file_name,
                          const std::function<Expected<void>(std::string_view line, int number)>& take) {
  std::istringstream lines(csv);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty()) continue;
    if (const auto taken = take(text, number); !taken) {
      return fail(fmt::format("{}:{}: {}", file_name, number, taken.error().message));
    }
  }
  return {};
}

// Hands the poses of lines with a time to `take`, whatever their times.
Expected<void> take_stamped(const std::string& csv, const std::string& file_name,
                            const std::function<Expected<void>(const StampedPose& pose)>& take) {
  return take_lines(csv, file_name, [&](std::string_view line, int number) -> Expected<void> {
    if (line.front() == '#' || names_columns(line, number)) return {};
    return pose_in(line).and_then(take);
  });
}

}  // namespace

Expected<std::vector<StampedPose>> parse_pose_csv(const std::string& csv, const std::string& file_name) {
  if (is_of_stations(csv)) {
    return fail(
        fmt::format("{}: is poses.csv of `crumple track`, which has no times: with --paired its poses belong to those "
                    "of the other file line by line",
                    file_name));
  }
  std::vector<StampedPose> poses;
  const auto taken = take_stamped(csv, file_name, [&](const StampedPose& pose) -> Expected<void> {
    if (!poses.empty() && pose.time_s < poses.back().time_s) {
      return fail("is older than the line before; sort the lines by time");
    }
    poses.push_back(pose);
    return {};
  });
  if (!taken) return tl::unexpected(taken.error());
  return poses;
}

Expected<std::vector<Pose>> parse_pose_list(const std::string& csv, const std::string& file_name) {
  std::vector<Pose> poses;
  const auto add = [&](const Pose& pose) -> Expected<void> {
    poses.push_back(pose);
    return {};
  };
  const std::size_t columns = comma_separated(std::string_view(csv).substr(0, csv.find('\n'))).size();
  // A station may be called #1: no line is passed over.
  const auto taken =
      is_of_stations(csv)
          ? take_lines(csv, file_name,
                       [&](std::string_view line, int number) -> Expected<void> {
                         return number == 1 ? Expected<void>() : station_pose_in(line, columns).and_then(add);
                       })
          : take_stamped(csv, file_name, [&](const StampedPose& pose) { return add(pose.fixed_from_moving); });
  if (!taken) return tl::unexpected(taken.error());
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

Expected<std::vector<Pose>> read_pose_list(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  return parse_pose_list(*text, file.string());
}

}  // namespace crumple
