// How sums over views are cut into parts that may run at the same time. The sums' bits depend on it, so it depends on
// the problem alone and never on the number of threads.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "solvers/parameters.h"

namespace crumple {

// How many parts the work falls into; few where there are so many common parameters that each part's sums are large.
std::size_t part_count(int common_size);

// Views in the order of the eliminated poses they hold (those without one last), and where each part of them begins; no
// eliminated pose is in two parts.
struct ViewPartition {
  std::vector<std::size_t> order;
  std::vector<std::size_t> begins;  // one more than there are parts

  std::size_t parts() const { return begins.size() - 1; }
};

ViewPartition partition(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                        std::size_t parts);

}  // namespace crumple
