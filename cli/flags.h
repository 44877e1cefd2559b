// Flags, strictly: a verb takes those it lists and nothing else.
//
// gflags holds definitions and values (DEFINE_* in the verbs' files); its own parser is not used, because it exits with
// code 1, lets --undefok and --flagfile hide typing errors, and accepts every flag any library defines. Forms taken:
//   --name=value  --name value  --bool  --nobool  --bool=false   with one dash or two, and - for _ inside a name.
// A flag given twice is an error. `--` ends the flags: what follows are inputs. Numbers have to be finite.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gflags/gflags_declare.h>

#include "solvers/expected.h"

// Flags of more than one verb (gflags aborts where a name is defined twice, so these live in flags.cc).
DECLARE_string(out);
DECLARE_bool(overwrite);
DECLARE_bool(bag);
DECLARE_bool(json);
DECLARE_string(images);
DECLARE_int32(threads);
DECLARE_string(stations);
DECLARE_string(truth);
DECLARE_string(format);
DECLARE_string(mount);
DECLARE_string(unit);

namespace crumple {

struct Arguments {
  std::vector<std::string> inputs;
  std::vector<std::string> given;  // names of the flags that were on the command line
  bool help = false;               // --help, which every verb takes
};

// Sets the flags named in `allowed` from the arguments behind the verb. The error is a usage error.
Expected<Arguments> parse_arguments(const std::vector<std::string>& arguments, const std::vector<std::string>& allowed);

// The values in force, by name.
std::map<std::string, std::string> flag_values(const std::vector<std::string>& names);

// Comma-separated finite numbers; the error names the flag.
Expected<std::vector<double>> parse_numbers(const std::string& flag, const std::string& text);

// Comma-separated names; empty ones are passed over.
std::vector<std::string> parse_names(const std::string& text);

// What --images and --threads come to.
std::optional<std::filesystem::path> images_folder();
int thread_count();

}  // namespace crumple
