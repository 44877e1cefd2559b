#include "cli/flags.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <thread>

#include <fmt/core.h>
#include <gflags/gflags.h>

#include "datasets/nearest_name.h"

DEFINE_string(out, "", "folder to write; must not exist unless --overwrite is given");
DEFINE_bool(overwrite, false,
            "replace the output folder, if it is one that Crumple wrote; with check, a bag's tag files");
DEFINE_bool(bag, false, "make a BagIt bag: the capture in data/, with the digests of all its files beside it");
DEFINE_bool(json, false, "print one JSON document instead of text");
DEFINE_string(images, "", "folder with the capture's images; empty: the one the description names, or its own");
DEFINE_int32(threads, 0, "threads to compute with; 0: as many as there are processors; the result is the same");
DEFINE_string(stations, "", "ids of the stations to take, comma-separated; empty: see above");
DEFINE_string(truth, "", "the truth folder of a simulated capture; adds how far the result is from it");
DEFINE_string(format, "", "opencv, kalibr, ros, colmap or mrcal");
DEFINE_string(mount, "", "sensors to write of a rig that has both: probe, or world for those fixed to the world");
DEFINE_string(unit, "", "of lengths in formats that state none (opencv, colmap, mrcal): mm, cm or m");

namespace crumple {
namespace {

struct Setting {
  std::string name;
  std::optional<std::string> value;
};

bool looks_like_flag(const std::string& argument) { return argument.size() > 1 && argument[0] == '-'; }

Setting split(const std::string& argument) {
  const std::string body = argument.substr(argument.rfind("--", 0) == 0 ? 2 : 1);
  const std::size_t equals = body.find('=');
  Setting setting{body.substr(0, equals), std::nullopt};
  if (equals != std::string::npos) setting.value = body.substr(equals + 1);
  std::replace(setting.name.begin(), setting.name.end(), '-', '_');
  return setting;
}

std::optional<gflags::CommandLineFlagInfo> find_flag(const std::string& name, const std::vector<std::string>& allowed) {
  gflags::CommandLineFlagInfo info;
  const bool listed = std::find(allowed.begin(), allowed.end(), name) != allowed.end();
  if (!listed || !gflags::GetCommandLineFlagInfo(name.c_str(), &info)) return std::nullopt;
  return info;
}

tl::unexpected<Error> unknown_flag(const std::string& argument, const std::string& name,
                                   const std::vector<std::string>& allowed) {
  const std::string nearest = nearest_name(name, allowed);
  const std::string hint = nearest.empty() ? std::string() : fmt::format(" Did you mean --{}?", nearest);
  return fail(fmt::format("Unknown flag {}.{}", argument.substr(0, argument.find('=')), hint));
}

std::string kind_of_value(const std::string& type) {
  if (type == "bool") return "true or false";
  return type == "double" ? "a finite number" : "a whole number in range";
}

Expected<void> set_flag(const gflags::CommandLineFlagInfo& info, const std::string& value) {
  const auto rejected = [&] {
    return fail(fmt::format("--{}={} is not {}.", info.name, value, kind_of_value(info.type)));
  };
  if (gflags::SetCommandLineOption(info.name.c_str(), value.c_str()).empty()) return rejected();
  if (info.type == "double") {
    double number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size() || !std::isfinite(number)) return rejected();
  }
  return {};
}

}  // namespace

Expected<Arguments> parse_arguments(const std::vector<std::string>& arguments,
                                    const std::vector<std::string>& allowed) {
  Arguments result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--") {
      result.inputs.insert(result.inputs.end(), arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                           arguments.end());
      break;
    }
    if (!looks_like_flag(argument)) {
      result.inputs.push_back(argument);
      continue;
    }
    if (argument == "--help" || argument == "-help" || argument == "-h") {
      result.help = true;
      continue;
    }
    auto [name, value] = split(argument);
    auto info = find_flag(name, allowed);
    if (!info && name.rfind("no", 0) == 0 && !value) {
      info = find_flag(name.substr(2), allowed);
      if (info && info->type != "bool") info.reset();
      if (info) value = "false";
    }
    if (!info) return unknown_flag(argument, name, allowed);
    if (std::find(result.given.begin(), result.given.end(), info->name) != result.given.end())
      return fail(fmt::format("--{} is given twice.", info->name));
    result.given.push_back(info->name);
    if (!value && info->type == "bool") value = "true";
    if (!value) {
      const bool follows = i + 1 < arguments.size() && arguments[i + 1].rfind("--", 0) != 0;
      if (!follows) return fail(fmt::format("--{} needs a value.", info->name));
      value = arguments[++i];
    }
    if (auto set = set_flag(*info, *value); !set) return tl::unexpected(set.error());
  }
  return result;
}

std::map<std::string, std::string> flag_values(const std::vector<std::string>& names) {
  std::map<std::string, std::string> values;
  for (const std::string& name : names) gflags::GetCommandLineOption(name.c_str(), &values[name]);
  return values;
}

Expected<std::vector<double>> parse_numbers(const std::string& flag, const std::string& text) {
  std::vector<double> numbers;
  const char* begin = text.data();
  const char* const end = begin + text.size();
  while (true) {
    const char* const comma = std::find(begin, end, ',');
    double number = 0;
    const auto [stop, error] = std::from_chars(begin, comma, number);
    if (error != std::errc() || stop != comma || !std::isfinite(number))
      return fail(fmt::format("--{}={} is not a list of numbers separated by commas.", flag, text));
    numbers.push_back(number);
    if (comma == end) return numbers;
    begin = comma + 1;
  }
}

std::vector<std::string> parse_names(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    if (comma > begin) names.push_back(text.substr(begin, comma - begin));
    begin = comma + 1;
  }
  return names;
}

std::optional<std::filesystem::path> images_folder() {
  if (FLAGS_images.empty()) return std::nullopt;
  return FLAGS_images;
}

int thread_count() {
  if (FLAGS_threads > 0) return FLAGS_threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace crumple
