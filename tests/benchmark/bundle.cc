// The joint refinement's speed beside mrcal's, OpenCV's and Ceres's on the same observations, and how time and memory
// grow with the number of boards.
#include "solvers/bundle.h"

#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <opencv2/calib3d.hpp>

#include "solvers/covariance.h"
#include "solvers/minimise.h"
#include "tests/benchmark/ceres_covariance.h"
#include "tests/benchmark/made_campaign.h"
#include "tests/benchmark/mrcal_peer.h"
#include "tests/benchmark/report.h"
#include "tests/solvers/ceres_minimise.h"
#include "tests/solvers/made_system.h"

DEFINE_int32(turns, 5, "times that ours and the peer run, in turns; the best counts");
DEFINE_int32(threads, 2, "ours; the peers run as they come");
DEFINE_int32(most_stations, 1000, "of the whole system, likewise");
DEFINE_int32(most_boards, 5000, "of the campaigns that show how time grows; 0 leaves them out");

namespace crumple {
namespace {

constexpr double kSameCost = 1e-6;  // relative
constexpr double kSameCovariance = 1e-8;
constexpr double kMostMemory_GB = 2;

std::set<BlockId> held_blocks(bool estimate_warp) {
  std::set<BlockId> held{{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}};
  if (!estimate_warp) held.insert({BlockId::Kind::warp, 0});
  return held;
}

std::vector<ViewWeights> unit_weights(const std::vector<std::unique_ptr<View>>& views) {
  std::vector<ViewWeights> weights;
  for (const auto& view : views)
    weights.push_back({1, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  return weights;
}

struct Solve {
  double seconds = 0;
  double cost = 0;
  int iterations = 0;
  CalibrationState state;
};

Solve solve(const Campaign& campaign, bool estimate_warp, const std::vector<Prior>& priors, int threads) {
  Solve result{0, 0, 0, campaign.start};
  result.seconds = seconds_of([&] {
    const auto views = make_views(campaign.observations, campaign.start.board_of);
    const Parameters parameters(result.state, views, held_blocks(estimate_warp));
    const MinimiseOptions options{.threads = threads, .priors = priors};
    const auto minimum = minimise(views, unit_weights(views), parameters, options, result.state);
    if (!minimum) throw std::runtime_error(minimum.error().message);
    result.cost = minimum->final_cost;
    result.iterations = minimum->iterations;
  });
  return result;
}

void expect_same_cost(const std::string& name, const Solve& ours, double peer) {
  fmt::print(stderr, "{}: {} iterations, cost {:.9g}, the peer's {:.9g}, relative difference {:+.1e}\n", name,
             ours.iterations, ours.cost, peer, ours.cost / peer - 1);
  if (!(std::abs(ours.cost / peer - 1) <= kSameCost)) throw std::runtime_error(name + ": not the same optimum");
}

// mrcal's regularisation counts in both: it keeps the rational terms from wandering along a valley.
void against_mrcal(const CampaignOptions& options, const std::vector<int>& thread_counts, std::vector<BenchRow>& rows) {
  const Campaign campaign = make_campaign(options);
  const MrcalPeer peer(campaign, options.corners);
  const std::vector<Prior> priors{peer.regularisation(campaign.start)};
  for (const int threads : thread_counts) {
    const std::string name = fmt::format("solve {} x {} x {}x{} OPENCV8, {} thread{}", options.cameras, options.boards,
                                         options.corners, options.corners, threads, threads == 1 ? "" : "s");
    Solve ours;
    PeerSolve theirs;
    rows.push_back(in_turns(
        name, "mrcal 2.2 optimize", FLAGS_turns,
        [&] { return (ours = solve(campaign, true, priors, threads)).seconds; },
        [&] { return (theirs = peer.solve()).seconds; }));
    expect_same_cost(name, ours, theirs.cost);
  }
}

// What this project's refinement was before: Ceres with the same residuals, Jacobians and placements eliminated.
void against_ceres(std::vector<BenchRow>& rows) {
  const CampaignOptions options{.cameras = 4};
  const Campaign campaign = make_campaign(options);
  const std::vector<Prior> priors{MrcalPeer(campaign, options.corners).regularisation(campaign.start)};
  const auto views = make_views(campaign.observations, campaign.start.board_of);
  const Parameters parameters(campaign.start, views, held_blocks(true));
  Solve ours;
  CeresMinimum theirs;
  const auto run_theirs = [&] {
    CalibrationState state = campaign.start;
    return seconds_of([&] {
      theirs =
          minimise_by_ceres(views, unit_weights(views), parameters, {.threads = FLAGS_threads, .priors = priors}, state)
              .value();
    });
  };
  const std::string name = fmt::format("solve 4 x 60 x 10x10 OPENCV8, {} threads", FLAGS_threads);
  rows.push_back(in_turns(
      name, "Ceres 2.1 DENSE_SCHUR", FLAGS_turns,
      [&] { return (ours = solve(campaign, true, priors, FLAGS_threads)).seconds; }, run_theirs));
  expect_same_cost(name, ours, theirs.final_cost);
}

void against_one_thread(std::vector<BenchRow>& rows) {
  const Campaign campaign = make_campaign({.cameras = 8, .boards = 200, .model = "LENSMODEL_OPENCV5"});
  rows.push_back(in_turns(
      fmt::format("solve 8 x 200 x 10x10 OPENCV5, {} threads", FLAGS_threads), "ours, 1 thread", FLAGS_turns,
      [&] { return solve(campaign, true, {}, FLAGS_threads).seconds; },
      [&] { return solve(campaign, true, {}, 1).seconds; }));
}

// OpenCV finds the board poses itself; ours starts from disturbed ones.
void against_opencv(std::vector<BenchRow>& rows) {
  const Campaign campaign = make_campaign({.model = "LENSMODEL_OPENCV5", .warped = false});
  const Board& board = campaign.start.boards[0];
  std::vector<cv::Point3f> corners;
  for (int i = 0; i < board.point_count(); ++i) {
    const Eigen::Vector3d corner = board.point(i);
    corners.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()), 0.F);
  }
  const std::vector<std::vector<cv::Point3f>> objects(campaign.observations.corners.size(), corners);
  std::vector<std::vector<cv::Point2f>> images;
  Campaign rounded = campaign;  // OpenCV takes single precision
  for (CornerView& view : rounded.observations.corners) {
    images.emplace_back();
    for (Eigen::Vector2d& pixel : view.pixels) {
      images.back().emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      pixel << images.back().back().x, images.back().back().y;
    }
  }
  const std::vector<double>& p = campaign.start.rig.sensors[0].lens.parameters();
  cv::Mat camera, distortion;
  std::vector<cv::Mat> rotations, translations;
  const auto theirs = [&] {
    camera = (cv::Mat_<double>(3, 3) << p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1);
    distortion.release();
    return seconds_of([&] {
      cv::calibrateCamera(objects, images, {4000, 2200}, camera, distortion, rotations, translations,
                          cv::CALIB_USE_INTRINSIC_GUESS);
    });
  };
  Solve ours;
  const std::string name = fmt::format("solve 1 x 60 x 10x10 OPENCV5 flat board, {} threads", FLAGS_threads);
  rows.push_back(in_turns(
      name, "cv::calibrateCamera 4.6", FLAGS_turns,
      [&] { return (ours = solve(rounded, false, {}, FLAGS_threads)).seconds; }, theirs));
  // The RMS that it returns is of single precision.
  double cost = 0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    std::vector<cv::Point2d> projected;
    cv::projectPoints(std::vector<cv::Point3d>(corners.begin(), corners.end()), rotations[v], translations[v], camera,
                      distortion, projected);
    for (std::size_t i = 0; i < projected.size(); ++i) {
      const cv::Point2d difference = projected[i] - cv::Point2d(images[v][i]);
      cost += 0.5 * difference.dot(difference);
    }
  }
  expect_same_cost(name, ours, cost);
}

void against_ceres_covariance(std::vector<BenchRow>& rows) {
  const CampaignOptions options{.cameras = 4};
  const Campaign campaign = make_campaign(options);
  const std::vector<Prior> priors{MrcalPeer(campaign, options.corners).regularisation(campaign.start)};
  const CalibrationState state = solve(campaign, true, priors, FLAGS_threads).state;
  const auto views = make_views(campaign.observations, state.board_of);
  const Parameters parameters(state, views, held_blocks(true));
  const CeresCovariance peer(views, parameters, priors, state);
  Eigen::MatrixXd ours, theirs;
  double condition = 0;
  const auto run = [&] {
    return seconds_of([&] {
      const auto evaluate = [&](std::size_t v, ViewEvaluation& at) { return views[v]->evaluate(state, true, at); };
      NormalEquations equations = NormalEquations::of(views, parameters, evaluate, FLAGS_threads).value();
      for (const Prior& prior : priors) equations.add(prior, state);
      JointCovariance covariance = JointCovariance::create(equations, state).value();
      covariance.sharpen(views, evaluate, priors, state, FLAGS_threads);
      condition = covariance.condition();
      ours = covariance.common();
    });
  };
  rows.push_back(in_turns(fmt::format("covariance 4 x 60 x 10x10 OPENCV8, {} threads", FLAGS_threads),
                          "ceres::Covariance SPARSE_QR", FLAGS_turns, run,
                          [&] { return seconds_of([&] { theirs = peer.common(); }); }));
  const Eigen::VectorXd scale = theirs.diagonal().cwiseSqrt().cwiseInverse();
  const double difference = (scale.asDiagonal() * (ours - theirs) * scale.asDiagonal()).cwiseAbs().maxCoeff();
  fmt::print(stderr, "covariance: condition {:.1e}, largest difference {:.1e} of the standard deviations\n", condition,
             difference);
  if (!(difference <= kSameCovariance)) throw std::runtime_error("covariance: not the same");
}

double peak_memory_GB() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    double kB = 0;
    if (key == "VmHWM:" && status >> kB) return kB / (1 << 20);
  }
  return 0;
}

void growth(std::vector<BenchRow>& rows) {
  for (int boards = FLAGS_most_boards / 8; boards > 0 && boards <= FLAGS_most_boards; boards *= 2) {
    const Campaign campaign = make_campaign({.cameras = 8, .boards = boards, .model = "LENSMODEL_OPENCV5"});
    const Solve ours = solve(campaign, true, {}, FLAGS_threads);
    fmt::print(stderr, "8 x {}: {} iterations, {:.4f} s per 1000 boards and iteration, peak memory {:.2f} GB\n", boards,
               ours.iterations, 1000 * ours.seconds / boards / ours.iterations, peak_memory_GB());
    if (peak_memory_GB() > kMostMemory_GB) throw std::runtime_error("growth: too much memory");
    rows.push_back({fmt::format("solve 8 x {} x 10x10 OPENCV5, {} threads", boards, FLAGS_threads), "", ours.seconds});
  }
}

// The whole system: four trackers, eight LEDs, camera and projector, stripes and corners at every station; gates, noise
// of every group and the covariance included.
void growth_of_chain(std::vector<BenchRow>& rows) {
  for (const int stations : {30, 125, 250, 500, 1000}) {
    if (stations > FLAGS_most_stations) continue;
    const MadeSystem made =
        make_system({.trackers = 4, .leds = 8, .stations = stations, .placements = 3, .tracker_placements = 20});
    const CalibrationState start = disturbed_system(made.truth, 5);
    int rounds = 0;
    const double seconds = seconds_of([&] {
      const auto result = refine(start, made.observations, {.threads = FLAGS_threads});
      if (!result) throw std::runtime_error("chain: " + result.error().message);
      rounds = result->rounds;
    });
    fmt::print(stderr, "chain of {} stations: {} rounds, {:.2f} s per 1000 stations and round, peak memory {:.2f} GB\n",
               stations, rounds, 1000 * seconds / stations / rounds, peak_memory_GB());
    rows.push_back(
        {fmt::format("refine the chain: {} stations, 4 trackers, 8 LEDs, {} threads", stations, FLAGS_threads), "",
         seconds});
  }
}

void run() {
  std::vector<BenchRow> rows;
  growth_of_chain(rows);  // first these two: their peak of memory is the program's so far
  growth(rows);
  against_mrcal({.cameras = 1}, {FLAGS_threads, 1}, rows);
  against_mrcal({.cameras = 4}, {FLAGS_threads, 1}, rows);
  against_one_thread(rows);
  against_ceres(rows);
  against_opencv(rows);
  against_ceres_covariance(rows);
  // With this much data mrcal's regularisation, which grows with it, draws lenses of the full distortion to a pole
  // among the observed corners, where ours have no image. One turn: mrcal takes minutes.
  against_mrcal({.cameras = 8, .boards = 200, .corners = 14, .distortion = 0.3}, {FLAGS_threads}, rows);
  report("bundle", rows);
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  try {
    crumple::run();
  } catch (const std::exception& failure) {
    fmt::print(stderr, "bundle: {}\n", failure.what());
    return 1;
  }
}
