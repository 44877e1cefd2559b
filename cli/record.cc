#include "cli/record.h"

#include <charconv>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include <fmt/chrono.h>

namespace crumple {

std::string date_of_run() {
  std::time_t seconds = std::time(nullptr);
  if (const char* const epoch = std::getenv("SOURCE_DATE_EPOCH")) {
    const std::string_view text = epoch;
    std::from_chars(text.data(), text.data() + text.size(), seconds);
  }
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(seconds));
}

Expected<RunRecord> record_of_run(const VerbContext& context, const std::vector<std::filesystem::path>& inputs,
                                  const std::map<std::string, std::uint64_t>& seeds) {
  auto hashed = hashed_files(inputs);
  if (!hashed) return tl::unexpected(hashed.error());
  return RunRecord{CRUMPLE_VERSION, context.verb, date_of_run(), context.flags, seeds, std::move(*hashed)};
}

Expected<void> commit_with_record(OutputFolder& folder, const RunRecord& record) {
  if (auto written = write_run_record(folder.path(), record); !written) return written;
  return folder.commit();
}

Expected<void> commit_with_record(OutputFolder& folder, const VerbContext& context,
                                  const std::vector<std::filesystem::path>& inputs,
                                  const std::map<std::string, std::uint64_t>& seeds) {
  const auto record = record_of_run(context, inputs, seeds);
  if (!record) return tl::unexpected(record.error());
  return commit_with_record(folder, *record);
}

}  // namespace crumple
