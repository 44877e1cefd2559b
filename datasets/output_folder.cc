#include "datasets/output_folder.h"

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

namespace crumple {
namespace fs = std::filesystem;
namespace {

std::string reason(int error_number) { return std::generic_category().message(error_number); }

Expected<void> check_free(const fs::path& path, bool overwrite) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(path, error);
  if (status.type() == fs::file_type::not_found) return {};
  if (error) return fail(fmt::format("{} cannot be looked at: {}.", path.string(), error.message()));
  if (!overwrite)
    return fail(fmt::format("{} exists already. Choose another --out, or give --overwrite.", path.string()));
  if (!fs::is_directory(status))
    return fail(fmt::format("{} is not a folder, so it cannot be replaced by one.", path.string()));
  if (fs::is_empty(path, error) || fs::exists(path / "ro-crate-metadata.json", error)) return {};
  return fail(
      fmt::format("{} does not look like a folder that Crumple wrote (it has no ro-crate-metadata.json), so "
                  "--overwrite leaves it alone. Remove it yourself, or choose another --out.",
                  path.string()));
}

Expected<void> flush_to_disk(const fs::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return fail(fmt::format("{} cannot be opened: {}.", path.string(), reason(errno)));
  const int result = fsync(descriptor);
  const int error_number = errno;
  close(descriptor);
  // Some file systems have no fsync for folders and say EINVAL.
  if (result != 0 && error_number != EINVAL)
    return fail(fmt::format("{} could not be written to disk: {}.", path.string(), reason(error_number)));
  return {};
}

Expected<void> flush_tree(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_symlink()) continue;
    if (auto flushed = flush_to_disk(entry.path()); !flushed) return flushed;
  }
  return flush_to_disk(folder);
}

// A new folder beside `path`, with a name nobody else has.
Expected<fs::path> make_sibling(const fs::path& path) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::string name = fmt::format(".{}.partial-{}-{}", path.filename().string(), getpid(), attempt);
    std::error_code error;
    if (fs::create_directory(path.parent_path() / name, error)) return path.parent_path() / name;
    if (error) return fail(fmt::format("{} cannot be written: {}.", path.parent_path().string(), error.message()));
  }
  return fail(fmt::format("{} is full of unfinished folders; remove them.", path.parent_path().string()));
}

}  // namespace

OutputFolder::OutputFolder(fs::path final_path, fs::path temporary, bool overwrite)
    : final_(std::move(final_path)), temporary_(std::move(temporary)), overwrite_(overwrite) {}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : final_(std::move(other.final_)),
      temporary_(std::exchange(other.temporary_, fs::path())),
      overwrite_(other.overwrite_) {}

OutputFolder& OutputFolder::operator=(OutputFolder&& other) noexcept {
  if (this != &other) {
    discard();
    final_ = std::move(other.final_);
    temporary_ = std::exchange(other.temporary_, fs::path());
    overwrite_ = other.overwrite_;
  }
  return *this;
}

OutputFolder::~OutputFolder() { discard(); }

void OutputFolder::discard() noexcept {
  if (temporary_.empty()) return;
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  temporary_.clear();
}

Expected<OutputFolder> OutputFolder::create(const fs::path& path, bool overwrite) {
  if (path.empty()) return fail("The name of the output folder is empty.");
  fs::path target = fs::absolute(path).lexically_normal();
  if (!target.has_filename()) target = target.parent_path();
  if (auto free = check_free(target, overwrite); !free) return tl::unexpected(free.error());
  std::error_code error;
  fs::create_directories(target.parent_path(), error);
  if (error) return fail(fmt::format("{} cannot be made: {}.", target.parent_path().string(), error.message()));
  auto sibling = make_sibling(target);
  if (!sibling) return tl::unexpected(sibling.error());
  return OutputFolder(std::move(target), std::move(*sibling), overwrite);
}

Expected<void> OutputFolder::commit() {
  if (auto flushed = flush_tree(temporary_); !flushed) return flushed;
  if (auto free = check_free(final_, overwrite_); !free) return free;
  std::error_code error;
  fs::path old;
  if (fs::exists(final_)) {
    auto sibling = make_sibling(final_);
    if (!sibling) return tl::unexpected(sibling.error());
    old = *sibling;
    fs::rename(final_, old, error);
    if (error) {
      fs::remove(old);
      return fail(fmt::format("{} cannot be replaced: {}.", final_.string(), error.message()));
    }
  }
  fs::rename(temporary_, final_, error);
  if (error) {
    std::error_code ignored;
    if (!old.empty()) fs::rename(old, final_, ignored);
    return fail(fmt::format("{} cannot be written: {}.", final_.string(), error.message()));
  }
  temporary_.clear();
  if (!old.empty()) fs::remove_all(old, error);
  return flush_to_disk(final_.parent_path());
}

Expected<void> write_file(const fs::path& file, const std::function<void(std::ostream&)>& writer) {
  const fs::path temporary = file.parent_path() / fmt::format(".{}.partial-{}", file.filename().string(), getpid());
  errno = 0;
  std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
  if (stream) writer(stream);
  stream.close();
  const int error_number = errno;
  std::error_code error;
  if (stream) {
    fs::rename(temporary, file, error);
    if (!error) return {};
  } else {
    error = std::error_code(error_number, std::generic_category());
  }
  std::error_code ignored;
  fs::remove(temporary, ignored);
  return fail(fmt::format("{} could not be written: {}.", file.string(), error.message()));
}

Expected<void> write_file(const fs::path& file, const std::string& content) {
  return write_file(file, [&](std::ostream& stream) { stream << content; });
}

Expected<std::string> read_file(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) return fail(fmt::format("{} does not exist.", file.string()));
  if (!fs::is_regular_file(status)) return fail(fmt::format("{} is not a file.", file.string()));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string content(stream ? static_cast<std::size_t>(fs::file_size(file, error)) : 0, '\0');
  stream.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (!stream || error) return fail(fmt::format("{} could not be read: {}.", file.string(), reason(errno)));
  return content;
}

}  // namespace crumple
