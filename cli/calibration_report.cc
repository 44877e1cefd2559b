#include "cli/calibration_report.h"

#include <cctype>
#include <string_view>

#include <fmt/format.h>

#include "cli/progress.h"

namespace crumple {
namespace {

std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain = "-_./=,:+@%";
  bool plain = !word.empty();
  std::string quoted = "'";
  for (const char c : word) {
    plain = plain && (std::isalnum(static_cast<unsigned char>(c)) != 0 || kPlain.find(c) != std::string_view::npos);
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return plain ? word : quoted + "'";
}

}  // namespace

std::string command_line(const VerbContext& context) {
  std::string line = "crumple " + context.verb;
  for (const std::string& word : context.words) line += " " + shell_word(word);
  return line;
}

Expected<void> write_calibration_report(const CalibrationReport& report, const OutputFolder& folder) {
  const auto html = calibration_report_html(report);
  if (html) return write_file(folder / "report.html", *html);
  log_warning(fmt::format("no report.html: {}", html.error().message));
  return {};
}

}  // namespace crumple
