// OpenCV's loops on threads that ThreadSanitizer sees: those of its own library synchronise inside code that is not
// instrumented, so that every result another thread wrote would be reported as a race. Linked into programs built for
// ThreadSanitizer only.
#include <atomic>
#include <memory>
#include <thread>

#include <opencv2/core/parallel/parallel_backend.hpp>

#include "solvers/parallel.h"

namespace crumple {
namespace {

class SeenThreads : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body, void* data) override {
    crumple::parallel_for(static_cast<std::size_t>(tasks), threads_,
                          [&](std::size_t task) { body(static_cast<int>(task), static_cast<int>(task) + 1, data); });
  }
  int getThreadNum() const override {
    static std::atomic<int> started{0};
    thread_local const int number = started++;
    return number;
  }
  int getNumThreads() const override { return threads_; }
  int setNumThreads(int threads) override { return threads_.exchange(threads > 0 ? threads : 2); }
  const char* getName() const override { return "crumple"; }

 private:
  std::atomic<int> threads_{2};
};

const bool replaced = (cv::parallel::setParallelForBackend(std::make_shared<SeenThreads>()), true);

}  // namespace
}  // namespace crumple
