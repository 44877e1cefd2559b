// Which views each point of a cloud was made of (recon/cloud.h), merged or not.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "recon/cloud.h"

namespace crumple {

class PointShares {
 public:
  // The cloud must outlive this. Precondition: its shares are in the order of its points.
  explicit PointShares(const Cloud& cloud);

  // `own` is room for the answer where the point is of its own view alone.
  std::span<const CloudShare> of(std::size_t point, CloudShare& own) const;

 private:
  const Cloud& cloud_;
  std::vector<std::uint32_t> first_;  // share of each point, and one past the last; empty where there are none
};

}  // namespace crumple
