// A loop over indices on several threads.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace crumple {

// Calls body(i) once for every i in [0, count), in no particular order; bodies must not depend on one another.
template <typename Body>
void parallel_for(int count, int threads, const Body& body) {
  std::atomic<int> next = 0;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < threads; ++i) helpers.emplace_back(work);
  work();
}

}  // namespace crumple
