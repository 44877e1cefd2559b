// The joint refinement's speed beside mrcal's, OpenCV's and Ceres's on the same observations from the same start, and
// how time and memory grow with the number of boards.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <thread>

#include <ceres/ceres.h>
#include <fmt/format.h>
#include <gflags/gflags.h>
#include <opencv2/calib3d.hpp>

#include "solvers/covariance.h"
#include "solvers/minimise.h"
#include "tests/benchmark/made_campaign.h"
#include "tests/benchmark/mrcal_peer.h"
#include "tests/benchmark/report.h"

DEFINE_int32(turns, 5, "times that ours and the peer run, in turns; the best counts");
DEFINE_int32(threads, 2, "ours; the peers run as they come");
DEFINE_string(only, "", "run only rows whose name holds this");

namespace crumple {
namespace {

constexpr double kSameCost = 1e-6;  // relative

struct Solve {
  double seconds = 0;
  double cost = 0;
  int iterations = 0;
  CalibrationState state;
};

Solve solve(const Campaign& campaign, bool estimate_warp, int threads) {
  Solve result{0, 0, 0, campaign.start};
  result.seconds = seconds_of([&] {
    const auto views = make_views(campaign.observations);
    std::vector<ViewWeights> weights;
    for (const auto& view : views) weights.push_back({1, 1, std::vector<char>(view->size(), 1)});
    std::set<BlockId> held{{BlockId::Kind::mount, 0}};
    if (!estimate_warp) held.insert({BlockId::Kind::warp});
    const Parameters parameters(result.state, views, held);
    const auto minimum = minimise(views, weights, parameters, {std::nullopt, threads}, result.state);
    if (!minimum) throw std::runtime_error(minimum.error().message);
    result.cost = minimum->final_cost;
    result.iterations = minimum->iterations;
  });
  return result;
}

void expect_same_cost(const std::string& name, double ours, double peer) {
  fmt::print(stderr, "{}: cost {:.9g}, the peer's {:.9g}, relative difference {:.1e}\n", name, ours, peer,
             ours / peer - 1);
  if (std::abs(ours / peer - 1) > kSameCost) throw std::runtime_error(name + ": not the same optimum");
}

BenchRow against_mrcal(const CampaignOptions& options, int threads) {
  const Campaign campaign = make_campaign(options);
  const MrcalPeer peer(campaign);
  const std::string name = fmt::format("{} x {} x {}x{}, {} thread{}", options.cameras, options.boards, options.corners,
                                       options.corners, threads, threads == 1 ? "" : "s");
  Solve ours;
  PeerSolve theirs;
  const BenchRow row = in_turns(
      name, "mrcal 2.2 optimize", FLAGS_turns, [&] { return (ours = solve(campaign, true, threads)).seconds; },
      [&] { return (theirs = peer.solve()).seconds; });
  fmt::print(stderr, "{}: {} iterations\n", name, ours.iterations);
  expect_same_cost(name, ours.cost, theirs.cost);
  return row;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  using namespace crumple;
  std::vector<BenchRow> rows;
  rows.push_back(against_mrcal({.cameras = 1}, FLAGS_threads));
  rows.push_back(against_mrcal({.cameras = 4}, FLAGS_threads));
  rows.push_back(against_mrcal({.cameras = 8, .boards = 200, .corners = 14}, FLAGS_threads));
  report("bundle", rows);
}
