// LEDs and room targets that a refinement may leave out as a whole, and those that it cannot spare: of LEDs with fewer
// than two accepted readings nothing tells where they are, and the refinement would fail.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "solvers/observations.h"
#include "solvers/prior.h"
#include "solvers/residuals.h"
#include "solvers/weights.h"

namespace crumple {

class DispensableLeds {
 public:
  // Held LEDs are known, whatever is read of them, and so are those whose place a prior tells.
  DispensableLeds(const Observations& observations, const std::set<std::size_t>& dispensable,
                  const std::set<BlockId>& held, const std::vector<Prior>& priors);

  // Whether the observation is of one. Views are numbered as make_views() makes them.
  bool reads(std::size_t view, int observation) const;

  // Those of which too few readings are accepted lose these too, and are held; with `try_again` until enough are
  // accepted again. Returns whether that changed anything.
  bool settle(bool try_again, std::vector<ViewWeights>& weights, std::set<BlockId>& held);

  // LEDs that can neither be spared nor are known keep all their readings where too few of them would stay: they
  // contradict each other, and nothing tells which is wrong.
  void keep_needed(std::vector<ViewWeights>& weights) const;

 private:
  using Readings = std::vector<std::pair<std::size_t, std::size_t>>;  // view and observation

  static std::ptrdiff_t accepted(const Readings& readings, const std::vector<ViewWeights>& weights);

  std::map<std::size_t, Readings> readings_;  // of those that can be spared
  std::vector<Readings> needed_;
  std::set<std::pair<std::size_t, std::size_t>> all_;
  std::set<std::size_t> left_out_;
};

}  // namespace crumple
