#include "cli/progress.h"

#include <algorithm>
#include <cstdio>

#include <fmt/core.h>
#include <unistd.h>

namespace crumple {
namespace {

constexpr std::size_t bar_width = 30;

// Unlike fmt::print this does not throw where stderr is closed or full: there is nobody left to tell.
void put(const std::string& text) { std::fputs(text.c_str(), stderr); }

// The bar that is showing; guarded by the mutex, as is stderr.
const Progress* showing = nullptr;

std::mutex& stderr_mutex() {
  static std::mutex mutex;
  return mutex;
}

bool on_terminal() {
  static const bool terminal = isatty(STDERR_FILENO) == 1;
  return terminal;
}

}  // namespace

void log_line(const std::string& line) {
  const std::lock_guard lock(stderr_mutex());
  if (showing) Progress::wipe();
  put(line + "\n");
  if (showing) showing->draw();
}

void log_warning(const std::string& line) { log_line("warning: " + line); }

Progress::Progress(std::string label, std::size_t total) : label_(std::move(label)), total_(total) {
  const std::lock_guard lock(stderr_mutex());
  if (!on_terminal() || showing) return;
  showing = this;
  draw();
}

Progress::~Progress() {
  const std::lock_guard lock(stderr_mutex());
  if (showing != this) return;
  wipe();
  showing = nullptr;
}

void Progress::advance(std::size_t steps) {
  const std::lock_guard lock(stderr_mutex());
  done_ = std::min(done_ + steps, total_);
  if (showing == this) draw();
}

void Progress::draw() const {
  const std::size_t filled = total_ == 0 ? bar_width : bar_width * done_ / total_;
  put(fmt::format("\r{} [{:-<{}}] {}/{}", label_, std::string(filled, '#'), bar_width, done_, total_));
  std::fflush(stderr);
}

void Progress::wipe() { put("\r\x1b[K"); }

}  // namespace crumple
