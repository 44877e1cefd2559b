// LEDs and room targets that a refinement may leave out as a whole: of those with fewer than two accepted readings
// nothing tells where they are, and the refinement would fail.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "solvers/observations.h"
#include "solvers/residuals.h"
#include "solvers/weights.h"

namespace crumple {

class DispensableLeds {
 public:
  // Held ones are known, whatever is read of them.
  DispensableLeds(const Observations& observations, const std::set<std::size_t>& dispensable,
                  const std::set<BlockId>& held);

  // Whether the observation is of one. Views are numbered as make_views() makes them.
  bool reads(std::size_t view, int observation) const;

  // Those of which too few readings are accepted lose these too, and are held; with `try_again` until enough are
  // accepted again. Returns whether that changed anything.
  bool settle(bool try_again, std::vector<ViewWeights>& weights, std::set<BlockId>& held);

 private:
  std::map<std::size_t, std::vector<std::pair<std::size_t, std::size_t>>> readings_;  // view and observation
  std::set<std::pair<std::size_t, std::size_t>> all_;
  std::set<std::size_t> left_out_;
};

}  // namespace crumple
