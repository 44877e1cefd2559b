// A run record: what it says went in has names by hashes; a refusal says why.
#include "datasets/run_record.h"

#include "datasets/recorded_inputs.h"
#include "tests/fuzz/input.h"
#include "tests/temporary_folder.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const TemporaryFolder given;
  write_content(given / run_record_name, text_of(data, size));
  const auto inputs = read_recorded_inputs(given.path());
  if (!inputs) {
    require(!inputs.error().message.empty(), "a refusal says why");
    return 0;
  }
  require(inputs->has_value(), "a record that is there is read or refused");
  for (const auto& [hash, name] : **inputs) require(!hash.empty(), "every input has a hash");
  return 0;
}
