#include "solvers/parallel.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace crumple {
namespace {

// The items of one call. Whoever works on it takes the next item until there is none; `work` is the caller's and is not
// touched after the last item is done.
class Job {
 public:
  Job(std::size_t count, const std::function<void(std::size_t)>& work) : count_(count), work_(work) {}

  void help() {
    for (std::size_t i = next_++; i < count_; i = next_++) {
      work_(i);
      if (++done_ == count_) done_.notify_all();
    }
  }

  void wait() const {
    for (std::size_t done = done_; done < count_; done = done_) done_.wait(done);
  }

 private:
  const std::size_t count_;
  const std::function<void(std::size_t)>& work_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<std::size_t> done_ = 0;
};

// Threads that help with whatever jobs are offered.
class Helpers {
 public:
  void offer(const std::shared_ptr<Job>& job, std::size_t helpers) {
    const std::lock_guard lock(mutex_);
    while (threads_.size() < helpers) {
      threads_.emplace_back([this](const std::stop_token& stop) { serve(stop); });
    }
    offers_.insert(offers_.end(), helpers, job);
    offered_.notify_all();
  }

  // What nobody took up is not offered any longer.
  void withdraw(const std::shared_ptr<Job>& job) {
    const std::lock_guard lock(mutex_);
    std::erase(offers_, job);
  }

 private:
  void serve(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (offered_.wait(lock, stop, [this] { return !offers_.empty(); })) {
      const std::shared_ptr<Job> job = std::move(offers_.front());
      offers_.pop_front();
      lock.unlock();
      job->help();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any offered_;
  std::deque<std::shared_ptr<Job>> offers_;
  std::vector<std::jthread> threads_;  // last: they end before what they use does
};

}  // namespace

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  const std::size_t strands = std::min(count, static_cast<std::size_t>(std::max(threads, 1)));
  if (strands <= 1) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  static Helpers helpers;
  const auto job = std::make_shared<Job>(count, work);
  helpers.offer(job, strands - 1);
  job->help();
  helpers.withdraw(job);
  job->wait();
}

}  // namespace crumple
