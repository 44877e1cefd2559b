// The program: finds the verb, reads its flags, runs it, prints its result.
#include <algorithm>
#include <climits>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <glog/logging.h>
#include <malloc.h>

#include "cli/flags.h"
#include "cli/help.h"
#include "cli/progress.h"
#include "cli/sentence.h"
#include "cli/verb.h"
#include "cli/verbs/verbs.h"
#include "datasets/json_text.h"
#include "datasets/nearest_name.h"

namespace crumple {
namespace {

// Ceres and OpenCV log through glog or stderr; only what ends a run is worth showing beside our own sentences.
void silence_libraries(const char* program) {
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_ERROR;
  google::InitGoogleLogging(program);
}

// Images and tables of one size come and go: giving their memory back to the system each time, to be cleared and mapped
// anew, cost a third of the time of a search for boards.
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

int print_to_stdout(const std::string& text, ExitCode exit_code) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (written) return static_cast<int>(exit_code);
  log_line("crumple: The result could not be written to stdout.");
  return static_cast<int>(ExitCode::bad_input);
}

int report_error(const std::string& message, ExitCode exit_code, bool json) {
  const std::string sentence = as_sentences(message);
  log_line("crumple: " + sentence);
  if (!json) return static_cast<int>(exit_code);
  const nlohmann::json document = {{"error", sentence}, {"exit_code", static_cast<int>(exit_code)}};
  return print_to_stdout(json_text(document).value_or("{}") + "\n", exit_code);
}

int report(const VerbResult& result, bool json) {
  const bool is_error = result.exit_code == ExitCode::usage || result.exit_code == ExitCode::internal_error;
  if (is_error) return report_error(result.text, result.exit_code, json);
  if (!json) return print_to_stdout(result.text, result.exit_code);
  const auto text = json_text(result.document);
  if (!text) return report_error(text.error().message, ExitCode::internal_error, json);
  return print_to_stdout(*text + "\n", result.exit_code);
}

const Verb* find_verb(const std::vector<Verb>& verbs, const std::string& name) {
  const auto found = std::find_if(verbs.begin(), verbs.end(), [&](const Verb& verb) { return verb.name == name; });
  return found == verbs.end() ? nullptr : &*found;
}

int unknown_verb(const std::vector<Verb>& verbs, const std::string& name, bool json) {
  std::vector<std::string> names;
  for (const Verb& verb : verbs) names.push_back(verb.name);
  const std::string nearest = nearest_name(name, names);
  const std::string hint = nearest.empty() ? "" : fmt::format(" Did you mean {}?", nearest);
  return report_error(fmt::format("Unknown verb {}.{} `crumple help` lists them.", name, hint), ExitCode::usage, json);
}

int help(const std::vector<Verb>& verbs, const std::vector<std::string>& names) {
  if (names.empty()) return print_to_stdout(program_help(verbs), ExitCode::done);
  const Verb* const verb = find_verb(verbs, names.front());
  if (!verb) return unknown_verb(verbs, names.front(), false);
  if (names.size() > 1) return report_error("help takes one verb at a time.", ExitCode::usage, false);
  return print_to_stdout(verb_help(*verb), ExitCode::done);
}

Expected<void> check_arguments(const Verb& verb, const Arguments& arguments) {
  const std::size_t count = arguments.inputs.size();
  const std::string usage = fmt::format(" `crumple help {}` shows how to use it.", verb.name);
  if (count < verb.min_inputs)
    return fail(fmt::format("{} needs {} input(s), {} given.", verb.name, verb.min_inputs, count) + usage);
  if (count > verb.max_inputs)
    return fail(fmt::format("Unexpected argument {}.", arguments.inputs[verb.max_inputs]) + usage);
  const auto values = flag_values(verb.required);
  for (const std::string& name : verb.required) {
    const bool given = std::find(arguments.given.begin(), arguments.given.end(), name) != arguments.given.end();
    if (!given || values.at(name).empty()) return fail(fmt::format("{} needs --{}.", verb.name, name) + usage);
  }
  return {};
}

int run_verb(const Verb& verb, const std::vector<std::string>& words, bool json) {
  const auto arguments = parse_arguments(words, verb.flags);
  if (!arguments)
    return report_error(fmt::format("{} `crumple help {}` lists the flags.", arguments.error().message, verb.name),
                        ExitCode::usage, json);
  if (arguments->help) return print_to_stdout(verb_help(verb), ExitCode::done);
  if (auto checked = check_arguments(verb, *arguments); !checked)
    return report_error(checked.error().message, ExitCode::usage, json);
  const auto result = verb.run({verb.name, arguments->inputs, flag_values(verb.flags), words});
  if (!result) return report_error(result.error().message, ExitCode::bad_input, json);
  return report(*result, FLAGS_json);
}

int run_program(const std::vector<std::string>& words, bool json) {
  const std::vector<Verb> verbs = all_verbs();
  if (words.empty()) {
    std::fputs(program_help(verbs).c_str(), stderr);
    return static_cast<int>(ExitCode::usage);
  }
  const std::vector<std::string> rest(words.begin() + 1, words.end());
  const std::string& first = words.front();
  if (first == "--version" && rest.empty()) return print_to_stdout("crumple " CRUMPLE_VERSION "\n", ExitCode::done);
  if (first == "help" || ((first == "--help" || first == "-h") && rest.empty())) return help(verbs, rest);
  const Verb* const verb = find_verb(verbs, first);
  return verb ? run_verb(*verb, rest, json) : unknown_verb(verbs, first, json);
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  using crumple::ExitCode;
  bool json = false;
  try {
    crumple::keep_freed_memory();
    crumple::silence_libraries(argv[0]);
    const std::vector<std::string> words(argv + 1, argv + argc);
    // Read ahead of the flags proper, so that a mistake in those is reported in the form that was asked for.
    const auto end_of_flags = std::find(words.begin(), words.end(), "--");
    json = std::find(words.begin(), end_of_flags, "--json") != end_of_flags;
    return crumple::run_program(words, json);
  } catch (const std::bad_alloc&) {
    return crumple::report_error("Out of memory.", ExitCode::internal_error, json);
  } catch (const std::filesystem::filesystem_error& error) {
    return crumple::report_error(fmt::format("{}: {}.", error.path1().string(), error.code().message()),
                                 ExitCode::bad_input, json);
  } catch (const std::exception& error) {
    return crumple::report_error(fmt::format("Internal error, please report it: {}.", error.what()),
                                 ExitCode::internal_error, json);
  } catch (...) {
    return crumple::report_error("Internal error, please report it.", ExitCode::internal_error, json);
  }
}
