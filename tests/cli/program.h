// Runs the real program, as a shell would.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <sys/wait.h>

#include "tests/temporary_folder.h"

namespace crumple {

struct ProgramRun {
  int exit_code = -1;
  std::string out;
  std::string err;
};

// Some commands change the folder before they run it.
inline std::string program_path() { return std::filesystem::absolute(CRUMPLE_PROGRAM).string(); }

// `arguments` are shell words; `before` stands in front of the program (variables, limits).
inline ProgramRun run_program(const std::string& arguments, const std::string& before = "") {
  const TemporaryFolder folder;
  const std::string command = before + " '" + program_path() + "' " + arguments + " >'" + (folder / "out").string() +
                              "' 2>'" + (folder / "err").string() + "' </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "out"), content_of(folder / "err")};
}

}  // namespace crumple
