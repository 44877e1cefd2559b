#include "solvers/parallel.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace crumple {

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  const auto strand = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  const std::size_t strands = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
  std::vector<std::jthread> others;
  for (std::size_t t = 1; t < strands; ++t) others.emplace_back(strand);
  strand();
}

}  // namespace crumple
