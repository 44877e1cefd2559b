// What the program says while it works, on stderr: log lines, and a bar where stderr is a terminal.
#pragma once

#include <cstddef>
#include <mutex>
#include <string>

namespace crumple {

// One line on stderr, above a bar that may be showing.
void log_line(const std::string& line);
void log_warning(const std::string& line);  // prefixed with "warning: "

// A bar for `total` steps. Steps may be reported from several threads. The bar is wiped when the object goes.
class Progress {
 public:
  Progress(std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);

 private:
  friend void log_line(const std::string& line);
  void draw() const;
  static void wipe();

  std::string label_;
  std::size_t total_;
  std::size_t done_ = 0;
};

}  // namespace crumple
