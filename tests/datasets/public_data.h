// Where the public data sets lie that tests may use: CRUMPLE_DATA, else ../shared/data beside the project.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace crumple {

inline std::optional<std::filesystem::path> public_data(const std::string& name) {
  const char* folder = std::getenv("CRUMPLE_DATA");
  const std::filesystem::path root =
      folder != nullptr ? std::filesystem::path(folder) : std::filesystem::path(CRUMPLE_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::is_directory(root / name)) return {};
  return root / name;
}

}  // namespace crumple
