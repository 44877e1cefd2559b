// A plan of what to measure. Distances and angles are of features that there are.
#include "tests/fuzz/plan.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto plan = read_as_plan(data, size, read_measuring_plan);
  if (!plan) return 0;
  require_sound(plan->features);
  for (const auto* const list : {&plan->distances, &plan->angles}) {
    for (const std::vector<std::size_t>& named : *list) {
      require(named.size() == 2 || (list == &plan->angles && named.size() == 3), "they are of two or three");
      for (const std::size_t feature : named) require(feature < plan->features.size(), "they are of features");
    }
  }
  for (const std::vector<std::size_t>& pair : plan->distances) {
    require(plan->features[pair.front()].kind != PlannedFeature::Kind::plane, "a plane stands second");
  }
  return 0;
}
