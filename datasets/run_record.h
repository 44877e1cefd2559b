// What a run did, beside its results: an RO-Crate 1.1 (ro-crate-metadata.json) in the manner of the Process Run Crate
// profile. Inputs and outputs with SHA-256, program version, effective flags, seeds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "solvers/expected.h"

namespace crumple {

inline constexpr const char* run_record_name = "ro-crate-metadata.json";

struct HashedFile {
  std::filesystem::path path;
  std::uintmax_t size = 0;  // bytes
  std::string sha256;       // 64 hexadecimal digits
};

struct RunRecord {
  std::string program_version;
  std::string verb;
  // RO-Crate demands a date, ISO 8601 with the day at least. It is the only thing that may differ between two runs.
  std::string date;
  std::map<std::string, std::string> flags;
  std::map<std::string, std::uint64_t> seeds;
  std::vector<HashedFile> inputs;
};

// 64 hexadecimal digits; 128 of SHA-512. Fails, naming the file, where it cannot be read.
Expected<std::string> sha256_of_file(const std::filesystem::path& file);
Expected<std::string> sha512_of_file(const std::filesystem::path& file);
std::string sha256_of_text(const std::string& text);

// Files, or folders: every file below them, in the order of their names. Fails, naming the file, where one cannot be
// read.
Expected<std::vector<HashedFile>> hashed_files(const std::vector<std::filesystem::path>& paths);

// Hashes every file below `folder`, and writes the record into it. Call it last, before the folder is
// committed.
Expected<void> write_run_record(const std::filesystem::path& folder, const RunRecord& record);

}  // namespace crumple
