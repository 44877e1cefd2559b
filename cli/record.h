// How a verb finishes its output folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "cli/verb.h"
#include "datasets/output_folder.h"
#include "datasets/run_record.h"
#include "solvers/expected.h"

namespace crumple {

// Today, or the day of SOURCE_DATE_EPOCH where the environment sets it (reproducible-builds.org), ISO 8601.
std::string date_of_run();

// What the run did, its inputs (files or folders) hashed; its date is date_of_run.
Expected<RunRecord> record_of_run(const VerbContext& context, const std::vector<std::filesystem::path>& inputs,
                                  const std::map<std::string, std::uint64_t>& seeds = {});

// Writes the run record (see datasets/run_record.h) into the folder and gives the folder its final name.
Expected<void> commit_with_record(OutputFolder& folder, const RunRecord& record);
Expected<void> commit_with_record(OutputFolder& folder, const VerbContext& context,
                                  const std::vector<std::filesystem::path>& inputs = {},
                                  const std::map<std::string, std::uint64_t>& seeds = {});

}  // namespace crumple
