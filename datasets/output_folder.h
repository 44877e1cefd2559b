// An output folder that exists completely or not at all.
//
// Files are written into a temporary sibling (".NAME.partial-..."); commit() gives it the final name. Where that does
// not happen (an error, an exception) the destructor removes the temporary.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include "solvers/expected.h"

namespace crumple {

class OutputFolder {
 public:
  // Fails where `path` exists, unless `overwrite` is set and it is empty or a folder that Crumple wrote (it holds a run
  // record, ro-crate-metadata.json; a BagIt bag without one is somebody's own capture): a slip must not delete
  // somebody's home. Missing parent folders are made.
  static Expected<OutputFolder> create(const std::filesystem::path& path, bool overwrite);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&& other) noexcept;
  ~OutputFolder();

  // Where to write until commit().
  const std::filesystem::path& path() const { return temporary_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return temporary_ / name; }
  const std::filesystem::path& final_path() const { return final_; }

  // Flushes everything to the disk and renames. A full disk is found here at the latest.
  Expected<void> commit();

 private:
  OutputFolder(std::filesystem::path final_path, std::filesystem::path temporary, bool overwrite);
  void discard() noexcept;

  std::filesystem::path final_;
  std::filesystem::path temporary_;  // empty once committed or moved from
  bool overwrite_ = false;
};

// Writes one whole file by way of a temporary name; fails naming it where the disk is full or the folder cannot be
// written, and leaves nothing then.
Expected<void> write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& writer);
Expected<void> write_file(const std::filesystem::path& file, const std::string& content);

// Reads one whole file; fails naming it where it is missing, no plain file or cannot be read.
Expected<std::string> read_file(const std::filesystem::path& file);

}  // namespace crumple
