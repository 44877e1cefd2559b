// What a verb of the program is: one struct per cli/verbs/NAME.cc, listed in cli/verbs/verbs.cc.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "solvers/expected.h"

namespace crumple {

enum class ExitCode : int {
  done = 0,
  internal_error = 1,
  usage = 2,
  bad_input = 3,    // an output folder that exists and a full disk too
  not_trusted = 4,  // solved, but the result is not to be relied on; it says why
  part_of_batch_failed = 5,
};

// What a verb gets: everything on the command line, checked against its own list of flags. FLAGS_* are set.
struct VerbContext {
  std::string verb;
  std::vector<std::string> inputs;           // as many as the verb says it takes
  std::map<std::string, std::string> flags;  // effective value of every flag of the verb, for the run record
  std::vector<std::string> words;            // behind the verb, as they were typed
};

// What a verb answers. Printed once, at the end: `text` on stdout, or `document` instead where --json was given. With
// `usage` and `internal_error` the text is an error sentence and goes to stderr.
struct VerbResult {
  ExitCode exit_code = ExitCode::done;
  std::string text;
  nlohmann::json document = nlohmann::json::object();
};

// For flags that contradict each other: exit code 2.
inline VerbResult usage_error(std::string sentence) { return {ExitCode::usage, std::move(sentence), {}}; }

struct Verb {
  std::string name;
  std::string purpose;      // one line without a full stop
  std::string usage;        // what follows `crumple NAME`, such as "CAPTURE --out=DIR [--flags]"
  std::string description;  // a few sentences; may be empty
  std::string example;      // a command and what it prints, as on a terminal
  std::size_t min_inputs = 0;
  std::size_t max_inputs = 0;
  std::vector<std::string> flags;     // every flag it takes; any other is rejected
  std::vector<std::string> required;  // those of them that must be given
  // An error means bad input (exit code 3).
  std::function<Expected<VerbResult>(const VerbContext&)> run;
};

}  // namespace crumple
