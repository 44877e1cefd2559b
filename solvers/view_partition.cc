#include "solvers/view_partition.h"

#include <algorithm>
#include <numeric>

namespace crumple {
namespace {

constexpr std::size_t kMostSums = 32;
constexpr std::size_t kLeastParts = 4;
constexpr std::size_t kPartsEntries = 8'000'000;  // of the common equations, in all parts together

}  // namespace

std::size_t part_count(int common_size) {
  const auto entries = static_cast<std::size_t>(std::max(common_size, 1)) * static_cast<std::size_t>(common_size + 1);
  return std::clamp(kPartsEntries / std::max<std::size_t>(entries, 1), kLeastParts, kMostSums);
}

ViewPartition partition(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                        std::size_t parts) {
  std::vector<std::optional<std::size_t>> slots;
  for (const auto& view : views) slots.push_back(parameters.slot(view->blocks()));
  ViewPartition result;
  result.order.resize(views.size());
  std::iota(result.order.begin(), result.order.end(), std::size_t{0});
  std::stable_sort(result.order.begin(), result.order.end(), [&](std::size_t a, std::size_t b) {
    return slots[a].value_or(parameters.eliminated().size()) < slots[b].value_or(parameters.eliminated().size());
  });
  const std::size_t share = (views.size() + parts - 1) / parts;
  for (std::size_t i = 0; i < result.order.size(); ++i) {
    const auto& slot = slots[result.order[i]];
    const bool may_begin = i == 0 || !slot || slot != slots[result.order[i - 1]];
    if (may_begin && (i == 0 || i - result.begins.back() >= share)) result.begins.push_back(i);
  }
  result.begins.push_back(result.order.size());
  return result;
}

}  // namespace crumple
