// Debian's own Python as an oracle: another one may stand before it on PATH, and lacks the packages.
#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/temporary_folder.h"

namespace crumple {

// What the script says on stdout and stderr, and its exit code where that is not 0.
inline std::string run_python(const std::string& script, const std::string& argument = "") {
  const TemporaryFolder folder;
  write_content(folder / "script.py", script);
  const std::string command = "env -u PYTHONPATH -u PYTHONHOME /usr/bin/python3 '" + (folder / "script.py").string() +
                              "' '" + argument + "' 2>&1";
  FILE* const pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 4096> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) output.append(block.data(), count);
  if (const int status = pclose(pipe)) output += "status " + std::to_string(status);
  return output;
}

inline bool python_has(const std::string& module) { return run_python("import " + module + "\n").empty(); }

}  // namespace crumple
