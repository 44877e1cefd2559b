#include "solvers/groups.h"

namespace crumple {

GroupKey key_of(const View& view) { return {view.sensor(), view.kind()}; }

std::optional<double> known_sigma(const Rig& rig, const GroupKey& key, const BundleOptions& options) {
  const auto known = options.known_sigma_px.find(group_name(rig, key.first, key.second));
  return known == options.known_sigma_px.end() ? std::nullopt : std::optional(known->second);
}

void set_sigmas(const std::vector<std::unique_ptr<View>>& views, const std::map<GroupKey, double>& sigmas,
                std::vector<ViewWeights>& weights) {
  for (std::size_t v = 0; v < views.size(); ++v) weights[v].sigma_px = sigmas.at(key_of(*views[v]));
}

}  // namespace crumple
