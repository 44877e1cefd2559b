// OpenCV's loops on threads that ThreadSanitizer sees: those of its own library synchronise inside code that is not
// instrumented, so that every result another thread wrote would be reported as a race. Linked into programs built for
// ThreadSanitizer only.
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include <opencv2/core/parallel/parallel_backend.hpp>

#include "solvers/parallel.h"

namespace crumple {
namespace {

// Which thread of a loop this is.
thread_local std::uint64_t of_loop = 0;
thread_local int number = 0;

class SeenThreads : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body, void* data) override {
    static std::atomic<std::uint64_t> loops{0};
    const std::uint64_t loop = ++loops;
    std::atomic<int> joined{0};
    crumple::parallel_for(static_cast<std::size_t>(tasks), threads_, [&](std::size_t task) {
      if (std::exchange(of_loop, loop) != loop) number = joined++;
      body(static_cast<int>(task), static_cast<int>(task) + 1, data);
    });
    number = 0;
  }
  int getThreadNum() const override { return number; }
  int getNumThreads() const override { return threads_; }
  int setNumThreads(int threads) override { return threads_.exchange(threads > 0 ? threads : 2); }
  const char* getName() const override { return "crumple"; }

 private:
  std::atomic<int> threads_{2};
};

const bool replaced = (cv::parallel::setParallelForBackend(std::make_shared<SeenThreads>()), true);

}  // namespace
}  // namespace crumple
