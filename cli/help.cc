#include "cli/help.h"

#include <algorithm>
#include <sstream>

#include <fmt/core.h>
#include <gflags/gflags.h>

namespace crumple {
namespace {

constexpr std::size_t text_width = 100;

// Words of `text` in lines of at most `width`, all but the first indented.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::istringstream words(text);
  std::string result, word;
  std::size_t column = indent;
  while (words >> word) {
    if (column > indent && column + 1 + word.size() > width) {
      result += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      result += ' ';
      ++column;
    }
    result += word;
    column += word.size();
  }
  return result;
}

std::string indented(const std::string& text) {
  std::istringstream lines(text);
  std::string result, line;
  while (std::getline(lines, line)) result += line.empty() ? "\n" : "  " + line + "\n";
  return result;
}

std::string flag_form(const gflags::CommandLineFlagInfo& info) {
  if (info.type == "bool") return "--[no]" + info.name;
  if (info.type == "string") return "--" + info.name + "=TEXT";
  return "--" + info.name + (info.type == "double" ? "=NUMBER" : "=N");
}

std::string flag_help(const std::string& name, bool required) {
  constexpr std::size_t column = 30;
  gflags::CommandLineFlagInfo info;
  gflags::GetCommandLineFlagInfo(name.c_str(), &info);
  std::string meaning = info.description;
  if (required)
    meaning += " (required)";
  else if (info.type == "bool")
    meaning += info.default_value == "true" ? " (default: yes)" : " (default: no)";
  else if (!info.default_value.empty())
    meaning += fmt::format(" (default: {})", info.default_value);
  const std::string form = flag_form(info);
  const std::string gap =
      form.size() + 3 < column ? std::string(column - form.size() - 2, ' ') : "\n" + std::string(column, ' ');
  return fmt::format("  {}{}{}\n", form, gap, wrapped(meaning, column, text_width));
}

}  // namespace

std::string program_help(const std::vector<Verb>& verbs) {
  std::string text =
      "Crumple calibrates camera-projector scanners and measures surfaces with them.\n\n"
      "Usage\n"
      "  crumple VERB INPUT... --out=DIR [--flags]\n"
      "  crumple help VERB\n"
      "  crumple --version\n\n"
      "Verbs\n";
  for (const Verb& verb : verbs) text += fmt::format("  {:<13}{}\n", verb.name, verb.purpose);
  text +=
      "\nResults go to stdout, log and progress to stderr.\n\n"
      "Exit codes\n"
      "  0  done\n"
      "  1  internal error\n"
      "  2  the command line is wrong\n"
      "  3  the input is bad, or the output cannot be written (a folder that exists included)\n"
      "  4  solved, but not trustworthy: the result says why\n"
      "  5  part of a batch failed\n";
  return text;
}

std::string verb_help(const Verb& verb) {
  std::string text =
      fmt::format("crumple {}: {}\n\nUsage\n  crumple {} {}\n", verb.name, verb.purpose, verb.name, verb.usage);
  if (!verb.description.empty()) text += "\n" + wrapped(verb.description, 0, text_width) + "\n";
  text += "\nExample\n" + indented(verb.example) + "\nFlags\n";
  for (const std::string& name : verb.flags) {
    const bool required = std::find(verb.required.begin(), verb.required.end(), name) != verb.required.end();
    text += flag_help(name, required);
  }
  return text;
}

}  // namespace crumple
