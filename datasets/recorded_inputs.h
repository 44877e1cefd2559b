// What a run record (datasets/run_record.h) says went in, to tell of two results whether they hang together.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "solvers/expected.h"

namespace crumple {

// The name of each file that went in, by its SHA-256.
using RecordedInputs = std::map<std::string, std::string>;

// Of the record that lies in `folder`; nothing where it has none. Fails, naming the file, where that is not a run
// record as Crumple writes it.
Expected<std::optional<RecordedInputs>> read_recorded_inputs(const std::filesystem::path& folder);

// How the results in two folders hang together by their records, each as far as it has one.
struct SharedInputs {
  bool second_from_first = false;  // the first's rig went into the second, as it is now
  bool first_from_second = false;
  // Files that went into both, by the first's names in their order: images, or the files of a rig that both went on
  // from. Descriptions (.yaml) do not count.
  std::vector<std::string> common;
};

// Fails as read_recorded_inputs does, or where a rig.yaml cannot be read.
Expected<SharedInputs> shared_inputs(const std::filesystem::path& first, const std::filesystem::path& second);

}  // namespace crumple
