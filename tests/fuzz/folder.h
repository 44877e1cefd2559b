// A folder of files as one input: each file behind a line "=== NAME", NAME being FILE or FOLDER/FILE.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

#include "tests/temporary_folder.h"

namespace crumple {

// Whether a file of this name stays in its folder.
inline bool stays_in_its_folder(const std::string& name) {
  return !name.empty() && name.size() < 100 && name.find('/') == std::string::npos &&
         name.find('\0') == std::string::npos && name != "." && name != "..";
}

// Files of one name follow each other; files that would leave the folder are passed over.
inline void unpack(const std::string& input, const std::filesystem::path& folder) {
  const std::string mark = "=== ";
  std::size_t at = input.starts_with(mark) ? 0 : input.find("\n" + mark);
  while (at != std::string::npos) {
    const std::size_t name_at = input.find(mark, at) + mark.size();
    const std::size_t end_of_line = std::min(input.find('\n', name_at), input.size());
    const std::string name = input.substr(name_at, end_of_line - name_at);
    at = input.find("\n" + mark, end_of_line);
    const std::size_t slash = name.find('/');
    const std::string parent = slash == std::string::npos ? "" : name.substr(0, slash);
    const std::string file = slash == std::string::npos ? name : name.substr(slash + 1);
    if (!(parent.empty() || stays_in_its_folder(parent)) || !stays_in_its_folder(file) || end_of_line >= input.size())
      continue;
    std::error_code ignored;
    std::filesystem::create_directory(folder / parent, ignored);
    write_content(folder / parent / file, input.substr(end_of_line + 1, at - end_of_line - 1));
  }
}

}  // namespace crumple
