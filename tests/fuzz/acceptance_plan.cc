// A plan of artefacts with their certificates. Spheres have diameters, bars two spheres, and limits are above zero.
#include "tests/fuzz/plan.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto plan = read_as_plan(data, size, read_acceptance_plan);
  if (!plan) return 0;
  require_sound(plan->features);
  for (std::size_t i = 0; i < plan->features.size(); ++i) {
    const bool sphere = plan->features[i].kind == PlannedFeature::Kind::sphere;
    require(sphere == (i < plan->diameters.size()), "spheres come first, each with its diameter");
  }
  for (const BallBar& bar : plan->bars) {
    require(bar.from != bar.to && bar.from < plan->diameters.size() && bar.to < plan->diameters.size(),
            "a bar has two spheres");
    require(bar.length.length_mm > 0 && bar.length.sigma_mm >= 0, "a bar has a length");
  }
  for (const auto& [name, limit] : plan->limits_mm) require(limit > 0 && std::isfinite(limit), "limits are numbers");
  return 0;
}
