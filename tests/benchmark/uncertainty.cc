// What uncertainty costs, beside the peers, from solved problems in memory: the joint covariance of the whole chain,
// maps of the projection uncertainty, and the covariance of a million points.
#include <cmath>
#include <exception>
#include <stdexcept>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "solvers/bundle.h"
#include "solvers/minimise.h"
#include "solvers/projection_uncertainty.h"
#include "tests/benchmark/ceres_covariance.h"
#include "tests/benchmark/made_campaign.h"
#include "tests/benchmark/mrcal_peer.h"
#include "tests/benchmark/point_rows.h"
#include "tests/benchmark/report.h"
#include "tests/solvers/made_system.h"

DEFINE_int32(turns, 3, "times that ours and the peer run, in turns; the best counts");
DEFINE_int32(threads, 2, "ours; the peers run as they come");

namespace crumple {
namespace {

constexpr int kColumns = 60, kRows = 40;
constexpr double kDistance_mm = 3000;
constexpr double kSameMap = 1e-6;
constexpr double kSameCovariance = 1e-8;

using Views = std::vector<std::unique_ptr<View>>;

std::vector<ViewWeights> unit_weights(const Views& views) {
  std::vector<ViewWeights> weights;
  for (const auto& view : views) {
    weights.push_back({1, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  }
  return weights;
}

// Each observation with a sigma of 1 px.
struct Problem {
  CalibrationState state;
  Views views;
  Parameters parameters;
  std::vector<Prior> priors;

  NormalEquations::Evaluate evaluate() const {
    return [this](std::size_t v, ViewEvaluation& at) { return views[v]->evaluate(state, true, at); };
  }
  JointCovariance covariance() const {
    NormalEquations equations = NormalEquations::of(views, parameters, evaluate(), FLAGS_threads).value();
    for (const Prior& prior : priors) equations.add(prior, state);
    auto covariance = JointCovariance::create(equations, state);
    if (!covariance) throw std::runtime_error(covariance.error().message);
    covariance->sharpen(views, evaluate(), priors, state, FLAGS_threads);
    return std::move(*covariance);
  }
  Rig rig() const {
    std::vector<const View*> all;
    for (const auto& view : views) all.push_back(view.get());
    Rig rig = state.rig;
    rig.covariance = covariance().of_rig_and(mean_body_motions(all, state));
    return rig;
  }
};

Problem solved(const CalibrationState& start, const Observations& observations, const std::set<BlockId>& held,
               const std::vector<Prior>& priors) {
  Views views = make_views(observations, start.board_of);
  Parameters parameters(start, views, held);
  CalibrationState state = start;
  const auto minimum =
      minimise(views, unit_weights(views), parameters, {.threads = FLAGS_threads, .priors = priors}, state);
  if (!minimum) throw std::runtime_error(minimum.error().message);
  return {std::move(state), std::move(views), std::move(parameters), priors};
}

ProjectionUncertaintyMap map_of(const Rig& rig) {
  const auto uncertainty = ProjectionUncertainty::create(rig, 0);
  if (!uncertainty) throw std::runtime_error(uncertainty.error().message);
  return projection_uncertainty_map(*uncertainty, kColumns, kRows, kDistance_mm, FLAGS_threads);
}

double largest_difference(const ProjectionUncertaintyMap& ours, const PeerUncertainty& theirs) {
  double largest = 0;
  for (std::size_t i = 0; i < theirs.covariance_px2.size(); ++i) {
    const Eigen::Matrix2d& peer = theirs.covariance_px2[i];
    if (!ours.covariance_px2[i]) throw std::runtime_error("a cell without a value");
    largest = std::max(largest, (*ours.covariance_px2[i] - peer).norm() / peer.norm());
  }
  return largest;
}

// mrcal as its users run it, with regularisation; and without, where its own formula is a shorter one. Without, both
// solve the same equations and the maps are compared; its regularisation it does not count as knowledge, so those
// differ.
void maps(const char* model, bool regularised, std::vector<BenchRow>& rows) {
  const CampaignOptions options{.cameras = 4, .model = model};
  Campaign campaign = make_campaign(options);
  std::vector<Prior> priors;
  if (regularised) priors = {MrcalPeer(campaign, options.corners).regularisation(campaign.start)};
  const Problem problem =
      solved(campaign.start, campaign.observations, {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}}, priors);
  campaign.start = problem.state;
  const MrcalPeer peer(campaign, options.corners);
  ProjectionUncertaintyMap ours;
  PeerUncertainty theirs;
  const std::string what = fmt::format("4 x 60 x 10x10 {}, {} regularisation, {} threads", model + 10,
                                       regularised ? "with" : "without", FLAGS_threads);
  rows.push_back(in_turns(
      fmt::format("map {}x{}, {}", kColumns, kRows, what), "mrcal 2.2 projection_uncertainty", FLAGS_turns,
      [&] { return seconds_of([&] { ours = map_of(problem.rig()); }); },
      [&] { return (theirs = peer.uncertainty(0, kColumns, kRows, kDistance_mm, regularised)).seconds; }));
  const double peer_s = rows.back().peer_s;
  const Rig rig = problem.rig();
  double cached_s = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < FLAGS_turns; ++turn) {
    cached_s = std::min(cached_s, seconds_of([&] { ours = map_of(rig); }));
  }
  rows.push_back({"the same with the covariance at hand", rows.back().peer, cached_s, peer_s});
  const double difference = largest_difference(ours, theirs);
  fmt::print(stderr, "{}: maps differ by {:.1e}\n", what, difference);
  if (!regularised && !(difference <= kSameMap)) throw std::runtime_error("maps: not the same");
}

void against_ceres(const std::string& what, const Problem& problem, std::vector<BenchRow>& rows) {
  const CeresCovariance peer(problem.views, problem.parameters, problem.priors, problem.state);
  std::optional<JointCovariance> ours;
  Eigen::MatrixXd theirs;
  rows.push_back(in_turns(
      fmt::format("covariance of {}, {} threads", what, FLAGS_threads), "ceres::Covariance SPARSE_QR", FLAGS_turns,
      [&] { return seconds_of([&] { ours.emplace(problem.covariance()); }); },
      [&] { return seconds_of([&] { theirs = peer.common(); }); }));
  const Eigen::VectorXd scale = theirs.diagonal().cwiseSqrt().cwiseInverse();
  const double difference = (scale.asDiagonal() * (ours->common() - theirs) * scale.asDiagonal()).cwiseAbs().maxCoeff();
  fmt::print(stderr, "{}: {} rows, condition {:.1e}, largest difference {:.1e} of the standard deviations\n", what,
             theirs.rows(), ours->condition(), difference);
  if (!(difference <= kSameCovariance)) throw std::runtime_error("covariance: not the same");
}

// Camera, projector, trackers, LEDs, stations and boards.
void chain(std::vector<BenchRow>& rows) {
  const MadeSystem made = make_system({.stations = 30, .placements = 3, .tracker_placements = 20});
  std::set<BlockId> held{{BlockId::Kind::mount, 0}, {BlockId::Kind::mount, 2}};
  for (std::size_t b = 0; b < made.truth.boards.size(); ++b) {
    held.insert({BlockId::Kind::warp, b});
    held.insert({BlockId::Kind::scale, b});
  }
  against_ceres("the chain: 30 stations, 2 trackers, 5 LEDs, camera, projector",
                solved(made.truth, made.observations, held, {}), rows);
}

void run() {
  std::vector<BenchRow> rows;
  chain(rows);
  maps("LENSMODEL_OPENCV8", true, rows);
  maps("LENSMODEL_OPENCV5", false, rows);
  const std::vector<BenchRow> points = point_rows(1000000, FLAGS_turns, FLAGS_threads);
  rows.insert(rows.end(), points.begin(), points.end());
  report("uncertainty", rows);
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  try {
    crumple::run();
  } catch (const std::exception& failure) {
    fmt::print(stderr, "uncertainty: {}\n", failure.what());
    return 1;
  }
}
