#include "solvers/parallel.h"

#include <atomic>
#include <chrono>
#include <future>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace crumple {
namespace {

TEST(ParallelFor, DoesEveryItemOnceAndIsDoneWhenItReturns) {
  for (const int threads : {-1, 0, 1, 2, 3, 8}) {
    for (const std::size_t count : {0U, 1U, 2U, 7U, 1000U}) {
      std::vector<int> times(count, 0);
      parallel_for(count, threads, [&](std::size_t i) { ++times[i]; });
      EXPECT_EQ(times, std::vector<int>(count, 1)) << threads;
    }
  }
}

// Each item waits until the other has begun.
TEST(ParallelFor, ItemsRunAtTheSameTime) {
  std::promise<void> begun[2];
  std::atomic<int> met = 0;
  parallel_for(2, 2, [&](std::size_t i) {
    begun[i].set_value();
    met += begun[1 - i].get_future().wait_for(std::chrono::seconds(60)) == std::future_status::ready;
  });
  EXPECT_EQ(met, 2);
}

TEST(ParallelFor, OneThreadIsTheCallers) {
  std::set<std::thread::id> seen;
  parallel_for(100, 1, [&](std::size_t) { seen.insert(std::this_thread::get_id()); });
  EXPECT_EQ(seen, std::set<std::thread::id>{std::this_thread::get_id()});
}

// Both outer items are under way, so every thread that could help is taken: the inner calls must not wait for one.
TEST(ParallelFor, DoesNotWaitForHelpThatNeverComes) {
  std::atomic<int> sum = 0;
  std::promise<void> inner_done;
  const auto done = inner_done.get_future().share();
  std::atomic<bool> in_time = false;
  parallel_for(2, 2, [&](std::size_t i) {
    if (i == 1) {
      in_time = done.wait_for(std::chrono::seconds(60)) == std::future_status::ready;
      return;
    }
    parallel_for(100, 2, [&](std::size_t k) { sum += static_cast<int>(k); });
    inner_done.set_value();
  });
  EXPECT_TRUE(in_time);
  EXPECT_EQ(sum, 4950);
}

}  // namespace
}  // namespace crumple
