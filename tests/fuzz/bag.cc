// A bag: its declaration, manifests and payload in one input. Every finding says where and what; a bag without findings
// has none either after its tags are written anew.
#include "datasets/bag.h"

#include "tests/fuzz/folder.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const TemporaryFolder bag;
  unpack(text_of(data, size), bag.path());
  const auto findings = check_bag(bag.path());
  for (const Finding& finding : findings) {
    require(!finding.where.empty() && !finding.sentence.empty(), "findings say where and what");
  }
  if (!findings.empty()) return 0;
  require(write_bag_tags(bag.path(), {"fuzzed", "2026-11-25"}).has_value(), "a sound bag can be written anew");
  require(check_bag(bag.path()).empty(), "and is sound");
  return 0;
}
