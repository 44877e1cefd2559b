// Random campaigns of tracked probes, from observations with noise: does every one, started from nothing but what was
// observed, reach the cost that a start from the truth reaches, or is it refused for a degeneracy that is there?
//
// Costs are sums of squares over the noise that was drawn. A refusal is confirmed by the rank of the whole Jacobian at
// the truth: its columns scaled to unit length, the smallest pivot of a dense QR with pivoting below 1e-6 of the
// largest.
#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include <Eigen/QR>
#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "calib/calibrate.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "solvers/parameters.h"
#include "tests/calib/made_system_data.h"

DEFINE_int32(campaigns, 100, "how many");
DEFINE_int32(first_seed, 1, "of the first campaign");
DEFINE_string(out, "out/bench/campaigns.json", "the result");

namespace crumple {
namespace {

using Json = nlohmann::json;

constexpr double kSameCost = 1e-4;
constexpr double kRankLimit = 1e-6;

MadeSystemOptions random_options(unsigned seed) {
  std::mt19937_64 random(seed);
  const auto whole = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  const auto real = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  MadeSystemOptions options;
  options.trackers = whole(1, 4);
  options.leds = whole(4, 8);
  options.led_spread_mm = real(150, 400);
  options.stations = whole(10, 40);
  options.placements = whole(1, 3);
  options.wand_stations = options.trackers > 1 ? whole(0, 15) : 0;
  options.tracker_placements = whole(6, 20);
  options.projector = whole(0, 1) == 1;
  // One in ten is only shifted about, or turned about one axis alone: hand and eye are not to be told from that.
  options.turn_deg = real(12, 35);
  const int kind = whole(1, 20);
  if (kind == 1) options.turn_deg = 0;
  if (kind == 2) options.one_axis = true;
  options.led_sigma_px = real(0.02, 0.2);
  options.corner_sigma_px = real(0.05, 0.2);
  options.stripe_sigma_px = real(0.05, 0.2);
  options.seed = seed;
  return options;
}

double noise_of(View::Kind kind, const MadeSystemOptions& options) {
  switch (kind) {
    case View::Kind::leds:
      return options.led_sigma_px;
    case View::Kind::stripes:
      return options.stripe_sigma_px;
    case View::Kind::corners:
    case View::Kind::features:
    case View::Kind::overlaps:
      break;
  }
  return options.corner_sigma_px;
}

double cost_of(const BundleResult& result, const MadeSystemOptions& options) {
  double cost = 0;
  for (const ViewSummary& view : result.views) {
    const double sigma_px = noise_of(view.kind, options);
    cost += 0.5 * view.residuals_px.squaredNorm() / (sigma_px * sigma_px);
  }
  return cost;
}

// Smallest over largest pivot of the scaled Jacobian at the truth, the gauge held as refine() holds it.
double smallest_pivot(const MadeSystem& made) {
  const auto views = make_views(made.observations, made.truth.board_of);
  std::set<BlockId> held{
      {BlockId::Kind::scale, 0}, {BlockId::Kind::scale, 1}, {BlockId::Kind::warp, 0}, {BlockId::Kind::warp, 1}};
  bool on_probe = false, in_world = false;
  for (std::size_t s = 0; s < made.truth.rig.sensors.size(); ++s) {
    bool& seen = made.truth.rig.sensors[s].mount == Mount::probe ? on_probe : in_world;
    if (!seen) held.insert({BlockId::Kind::mount, s});
    seen = true;
  }
  const Parameters parameters(made.truth, views, held);
  Eigen::Index rows = 0;
  for (const auto& view : views) rows += view->size() * view->dimension();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, parameters.size());
  Eigen::Index row = 0;
  for (const auto& view : views) {
    ViewEvaluation evaluation;
    if (!view->evaluate(made.truth, true, evaluation)) return 0;
    const Eigen::MatrixXd by_blocks = evaluation.jacobian * evaluation.local_from_blocks;
    for (const Parameters::Span& span : parameters.spans(view->blocks())) {
      const Eigen::Index column =
          span.slot ? parameters.common_size() + 6 * static_cast<Eigen::Index>(*span.slot) : span.common_offset;
      jacobian.block(row, column, by_blocks.rows(), span.size) = by_blocks.middleCols(span.column, span.size);
    }
    row += by_blocks.rows();
  }
  const Eigen::VectorXd lengths = jacobian.colwise().norm().transpose();
  if (!(lengths.minCoeff() > 0)) return 0;
  // A singular value itself would be set to zero where it is below rounding; the last pivot shows how far below it is.
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(jacobian * lengths.cwiseInverse().asDiagonal());
  const Eigen::VectorXd pivots = qr.matrixR().diagonal().cwiseAbs();
  return pivots.minCoeff() / pivots.maxCoeff();
}

int run() {
  Json rows = Json::array();
  int reached = 0, better = 0, refused_rightly = 0, refused_wrongly = 0, missed = 0;
  for (int i = 0; i < FLAGS_campaigns; ++i) {
    const MadeSystemOptions options = random_options(static_cast<unsigned>(FLAGS_first_seed + i));
    const MadeSystem made = make_system(options);
    const BundleOptions bundle{.reject_outliers = false, .threads = 2};
    const auto from_truth = refine(made.truth, made.observations, bundle);
    const auto found = calibrate(data_of(made), {.warp = WarpChoice::off, .bundle = bundle});
    const std::string shape =
        fmt::format("{} trackers, {} LEDs, {} stations at {} placements, {} wand, turns {:.0f} deg{}", options.trackers,
                    options.leds, options.stations, options.placements, options.wand_stations, options.turn_deg,
                    options.one_axis ? " about one axis" : "");
    Json row{{"seed", options.seed}, {"shape", shape}};
    std::string said;
    if (!found) {
      const double smallest = smallest_pivot(made);
      const bool degenerate = smallest < kRankLimit;
      (degenerate ? refused_rightly : refused_wrongly) += 1;
      row["refused"] = found.error().message;
      row["smallest_pivot"] = smallest;
      said = fmt::format("refused, {} ({:.1e}): {}", degenerate ? "rank deficient" : "RANK IS FULL", smallest,
                         found.error().message);
    } else if (!from_truth) {
      ++missed;
      said = "solved, where the start from the truth is refused: " + from_truth.error().message;
    } else {
      const double ours = cost_of(found->bundle, options), theirs = cost_of(*from_truth, options);
      const double excess = ours / theirs - 1;
      row["relative_excess"] = excess;
      if (std::abs(excess) <= kSameCost) {
        ++reached;
      } else {
        ++(excess < 0 ? better : missed);
      }
      said = fmt::format("cost {:.6g}, from the truth {:.6g}, excess {:+.1e}", ours, theirs, excess);
    }
    fmt::print("{:3}  {}: {}\n", options.seed, shape, said);
    rows.push_back(row);
  }
  fmt::print(
      "of {}: {} reached the truth's cost within {:g}, {} a lower one, {} refused with a deficient rank, {} refused "
      "with full rank, {} missed\n",
      FLAGS_campaigns, reached, kSameCost, better, refused_rightly, refused_wrongly, missed);
  const auto text = json_text({{"rows", rows},
                               {"reached", reached},
                               {"better", better},
                               {"refused_rank_deficient", refused_rightly},
                               {"refused_full_rank", refused_wrongly},
                               {"missed", missed}});
  const bool written = text && write_file(FLAGS_out, *text);
  return written && missed == 0 && refused_wrongly == 0 ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
