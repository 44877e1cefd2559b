#include "datasets/file_template.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr std::array<const char*, 4> kPlaceholders = {"station", "sensor", "frame", "frame_name"};

// The width in ":02" or ":2", 1 to 9.
std::optional<int> width_of(const std::string& format) {
  if (format.empty() || format.size() > 2 || (format.size() == 2 && format[0] != '0')) return {};
  const char digit = format.back();
  if (digit < '1' || digit > '9') return {};
  return digit - '0';
}

bool leaves_folder(const std::string& text) {
  const std::filesystem::path path(text);
  return path.is_absolute() || std::any_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
}

}  // namespace

bool stays_below(const std::string& text) {
  const std::filesystem::path path(text);
  return !path.is_absolute() && std::none_of(path.begin(), path.end(), [](const std::filesystem::path& part) {
    return !part.empty() && part.native().find_first_not_of('.') == std::string::npos;
  });
}

Expected<FileTemplate> FileTemplate::parse(const std::string& text) {
  if (leaves_folder(text)) {
    return fail("must stay below the image folder: no leading / and no `..`; name the folder in `images` instead");
  }
  FileTemplate result;
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool doubled = i + 1 < text.size() && text[i + 1] == text[i];
    if ((text[i] == '{' || text[i] == '}') && doubled) {
      plain += text[i++];
    } else if (text[i] == '}') {
      return fail("has a `}` without its `{`: write `}}` for a brace in a file name");
    } else if (text[i] == '{') {
      const std::size_t end = text.find('}', i);
      if (end == std::string::npos) return fail("has a `{` without its `}`: write `{{` for a brace in a file name");
      const std::string inside = text.substr(i + 1, end - i - 1);
      const std::size_t colon = inside.find(':');
      Part part{inside.substr(0, colon), "", 0};
      if (std::find(kPlaceholders.begin(), kPlaceholders.end(), part.placeholder) == kPlaceholders.end()) {
        return fail(
            fmt::format("has the unknown placeholder `{{{}}}`: known are {{station}}, {{sensor}}, {{frame}}, "
                        "{{frame:02}} and {{frame_name}}",
                        inside));
      }
      if (colon != std::string::npos) {
        const auto width = width_of(inside.substr(colon + 1));
        if (!width || part.placeholder != "frame") {
          return fail(fmt::format("has `{{{}}}`: a width is for {{frame}} only, such as {{frame:02}}", inside));
        }
        part.width = *width;
      }
      if (!plain.empty()) result.parts_.push_back({"", std::exchange(plain, {}), 0});
      result.parts_.push_back(part);
      i = end;
    } else {
      plain += text[i];
    }
  }
  if (!plain.empty()) result.parts_.push_back({"", plain, 0});
  return result;
}

bool FileTemplate::uses(const std::string& placeholder) const {
  return std::any_of(parts_.begin(), parts_.end(), [&](const Part& p) { return p.placeholder == placeholder; });
}

std::string FileTemplate::expand(const FileTemplateValues& values) const {
  std::string result;
  for (const Part& part : parts_) {
    if (part.placeholder.empty()) result += part.text;
    if (part.placeholder == "station") result += values.station;
    if (part.placeholder == "sensor") result += values.sensor;
    if (part.placeholder == "frame") result += fmt::format("{:0{}}", values.frame, std::max(part.width, 1));
    if (part.placeholder == "frame_name") result += values.frame_name;
  }
  return result;
}

}  // namespace crumple
