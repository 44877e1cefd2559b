// What the targets of plans have in common: the input as a file, and features that can be looked for.
#pragma once

#include <cmath>
#include <set>

#include "datasets/measuring_plan.h"
#include "tests/fuzz/input.h"
#include "tests/temporary_folder.h"

namespace crumple {

// `read` is read_measuring_plan or read_acceptance_plan.
template <typename Read>
auto read_as_plan(const std::uint8_t* data, std::size_t size, Read read) {
  const TemporaryFolder home;
  write_content(home / "plan.yaml", text_of(data, size));
  auto plan = read(home / "plan.yaml");
  if (!plan) require(!plan.error().message.empty(), "a refusal says why");
  return plan;
}

inline void require_sound(const std::vector<PlannedFeature>& features) {
  require(!features.empty(), "there is something to measure");
  std::set<std::string> seen;
  for (const PlannedFeature& feature : features) {
    require(seen.insert(feature.name).second, "no two features have one name");
    require(feature.near_mm.allFinite() && std::isfinite(feature.radius_mm), "numbers are finite");
    require(feature.box_mm ? !feature.box_mm->isEmpty() : feature.radius_mm > 0, "points are looked for somewhere");
  }
}

}  // namespace crumple
