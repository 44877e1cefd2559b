// What a benchmark against a peer reports: a table for people, out/bench/NAME.json for everything else.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace crumple {

struct BenchRow {
  std::string name;
  std::string peer;
  double ours_s = 0;
  double peer_s = 0;
};

// Best times of both, run in turns so that whatever else the machine does meets both alike. Each call runs once and
// returns its own seconds.
BenchRow in_turns(const std::string& name, const std::string& peer, int turns, const std::function<double()>& ours,
                  const std::function<double()>& theirs);

// Seconds that a call takes.
double seconds_of(const std::function<void()>& work);

// Prints a Markdown table and writes out/bench/NAME.json; rows without a peer leave its columns empty, null in JSON.
void report(const std::string& name, const std::vector<BenchRow>& rows);

}  // namespace crumple
