#include "solvers/parallel.h"

#include <algorithm>
#include <thread>
#include <vector>

namespace crumple {

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  const std::size_t stride = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
  const auto strand = [&](std::size_t first) {
    for (std::size_t i = first; i < count; i += stride) work(i);
  };
  std::vector<std::jthread> others;
  for (std::size_t t = 1; t < stride; ++t) others.emplace_back(strand, t);
  if (stride > 0) strand(0);
}

}  // namespace crumple
