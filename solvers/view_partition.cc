#include "solvers/view_partition.h"

#include <algorithm>
#include <numeric>

namespace crumple {
namespace {

constexpr std::size_t kMostViewParts = 32;
constexpr std::size_t kLeastParts = 4;
constexpr std::size_t kPartsEntries = 8'000'000;  // of the common equations, in all parts together

}  // namespace

std::size_t part_count(int common_size) {
  const auto entries = static_cast<std::size_t>(std::max(common_size, 1)) * static_cast<std::size_t>(common_size + 1);
  return std::clamp(kPartsEntries / std::max<std::size_t>(entries, 1), kLeastParts, kMostViewParts);
}

ViewPartition partition(const std::vector<std::unique_ptr<View>>& views, std::size_t parts) {
  ViewPartition result;
  result.order.resize(views.size());
  std::iota(result.order.begin(), result.order.end(), std::size_t{0});
  std::stable_sort(result.order.begin(), result.order.end(),
                   [&](std::size_t a, std::size_t b) { return views[a]->placement() < views[b]->placement(); });
  const std::size_t share = (views.size() + parts - 1) / parts;
  for (std::size_t i = 0; i < result.order.size(); ++i) {
    const bool new_placement = i == 0 || views[result.order[i]]->placement() != views[result.order[i - 1]]->placement();
    if (new_placement && (i == 0 || i - result.begins.back() >= share)) result.begins.push_back(i);
  }
  result.begins.push_back(result.order.size());
  return result;
}

}  // namespace crumple
