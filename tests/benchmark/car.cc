// Distances along a car side, 20 stations over 4 m (tests/calib/made_car.h): by the LEDs alone, with the stations
// refined by their overlap, and with targets beside it; against the truth, and against the uncertainty predicted. With
// a budget of where the error comes from.
//
// Every seed draws a campaign that calibrates the rig in one joint refinement, and a car that is then measured with it.
// By LEDs alone: each station's pose from its LEDs' pixels with the rig held, as `reconstruct` does it. The error is
// that of distances of 1 m and more between the centres of balls, RMS over distances and seeds.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "calib/calibrate.h"
#include "calib/refine_stations.h"
#include "calib/scale_bar.h"
#include "solvers/parameters.h"
#include "solvers/rig_covariance.h"
#include "tests/benchmark/car_distances.h"
#include "tests/calib/made_car.h"

DEFINE_int32(seeds, 10, "campaigns and cars of each rig");
DEFINE_int32(first_seed, 1, "of the first");
DEFINE_int32(rig, 0, "1, 2 or 3; 0: all");
DEFINE_string(out, "out/bench/car.json", "the result");

namespace crumple {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLeastDistance_mm = 1000;

struct NamedCarRig {
  const char* name;
  MadeCarOptions options;
  int targets_per_overlap;  // of the way that has targets
};

std::vector<NamedCarRig> car_rigs() {
  MadeCarOptions two{};
  MadeCarOptions four{.trackers = 4, .tracker_size = {2592, 1944}, .tracker_focal_px = 1960, .leds = 8};
  MadeCarOptions best = four;
  best.leds = 16;
  best.led_spread_mm = 400;
  best.led_sigma_px = 0.02;
  best.wand_stations = 200;
  best.bar_poses = 12;
  return {{"two 1024x768 trackers, 5 LEDs on 250 mm, 0.05 px", two, 0},
          {"four 2592x1944 trackers, 8 LEDs on 250 mm, 0.05 px", four, 0},
          {"the same four, 16 LEDs on 400 mm, 0.02 px, scale bar, 200 wand poses", best, 6}};
}

// One way to pose the stations, over distances and seeds.
struct Way {
  double squares = 0;
  double predicted = 0;  // sum of variances
  int count = 0;
  std::vector<double> rms_by_seed;
  std::map<std::string, double> budget;  // sums of variances, by source

  double rms() const { return std::sqrt(squares / count); }
  double sigma() const { return std::sqrt(predicted / count); }
};

// One bar that was shown at many poses.
ScaleBar shown_bar(const std::vector<MadeBar>& bars, double sigma_mm) {
  ScaleBar bar{.name = "bar", .places = {}, .length_mm = bars.front().length_mm, .placing_sigma_mm = 0.001};
  bar.certificate.pitch_sigma_mm = sigma_mm;
  for (const MadeBar& place : bars) bar.places.emplace_back(place.first_led, place.second_led);
  return bar;
}

Expected<Rig> calibrated(const MadeCarOptions& options, unsigned seed) {
  const MadeCampaign campaign = make_car_campaign(options, seed);
  BundleOptions bundle{.threads = 2};
  std::vector<PriorTerm> scales;
  for (std::size_t b = 0; b < campaign.start.boards.size(); ++b) scales.push_back({{BlockId::Kind::scale, b}, 0});
  const double variance = options.board_scale_sigma * options.board_scale_sigma;
  bundle.priors.push_back(
      Prior::create("certificates", scales, campaign.start, variance * Eigen::Matrix2d::Identity()).value());
  if (!campaign.bars.empty()) {
    bundle.priors.push_back(bar_prior(shown_bar(campaign.bars, options.bar_sigma_mm), {}));
  }
  // The optimum does not depend on the start (./dev bench campaigns), and from here it is soon reached.
  const auto result = refine(campaign.start, campaign.observations, bundle);
  if (!result) return tl::unexpected(result.error());
  Rig rig = result->state.rig;
  rig.covariance = rig_covariance(*result);
  std::erase_if(rig.leds, [](const Led& led) { return led.mount == Mount::world; });
  for (const GroupSummary& group : result->groups) {
    rig.sigma_px[group_name(rig, group.sensor, group.kind)] = group.sigma_px;
  }
  return rig;
}

// Blocks side by side.
struct Layout {
  std::vector<BlockId> blocks;
  std::map<BlockId, Eigen::Index> columns;
  Eigen::Index size = 0;

  void add(const BlockId& block, const CalibrationState& state) {
    blocks.push_back(block);
    columns[block] = size;
    size += tangent_size(block, state);
  }
};

Layout rig_layout(const CalibrationState& state, std::size_t leds) {
  Layout layout;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    layout.add({BlockId::Kind::lens, s}, state);
    layout.add({BlockId::Kind::mount, s}, state);
  }
  for (std::size_t l = 0; l < leds; ++l) layout.add({BlockId::Kind::led, l}, state);
  return layout;
}

// The rig's covariance by blocks; zero for what was held.
Eigen::MatrixXd rig_block_covariance(const Rig& rig, const Layout& layout, const CalibrationState& state) {
  std::vector<std::string> names;
  for (const BlockId& block : layout.blocks) {
    const std::vector<std::string> of_block = parameter_names(block, state);
    names.insert(names.end(), of_block.begin(), of_block.end());
  }
  return covariance_of(rig.covariance, names);
}

Eigen::RowVectorXd row_of(const BallDistance& distance, const Layout& layout) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(layout.size);
  for (const auto& [block, derivative] : distance.d_block) {
    const auto column = layout.columns.find(block);
    if (column != layout.columns.end()) row.segment(column->second, derivative.size()) += derivative;
  }
  return row;
}

// A station's pose from its LEDs with the rig held: its own covariance, and how it follows the rig.
struct HeldPose {
  Matrix6d covariance;
  Eigen::MatrixXd d_rig;  // 6 x rig
};

HeldPose held_pose(const CalibrationState& state, const ObservedStation& station, std::size_t s, const Rig& rig,
                   const Layout& layout) {
  Matrix6d information = Matrix6d::Zero();
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(6, layout.size);
  Observations leds;
  for (const LedReading& reading : station.readings) {
    leds.leds.push_back(reading.view);
    leds.leds.back().station = s;
  }
  for (const auto& view : make_views(leds, {})) {
    const double sigma = rig.sigma_px.at(group_name(rig, view->sensor(), View::Kind::leds));
    ViewEvaluation evaluation;
    if (!view->evaluate(state, true, evaluation)) continue;
    const Eigen::MatrixXd by_pose = block_jacobian(*view, evaluation, state, view->blocks().size() - 1) / sigma;
    information += by_pose.transpose() * by_pose;
    for (std::size_t b = 0; b + 1 < view->blocks().size(); ++b) {
      const Eigen::MatrixXd by_block = block_jacobian(*view, evaluation, state, b) / sigma;
      coupling.middleCols(layout.columns.at(view->blocks()[b]), by_block.cols()) += by_pose.transpose() * by_block;
    }
  }
  const Matrix6d covariance = information.inverse();
  return {covariance, -covariance * coupling};
}

double quadratic(const Eigen::RowVectorXd& row, const Eigen::MatrixXd& covariance) { return row.dot(row * covariance); }

// What the source is called that a block of the rig belongs to.
std::string source_of(const BlockId& block, const Rig& rig) {
  if (block.kind == BlockId::Kind::led) return "rig: hand-eye (LEDs on the probe)";
  const Sensor& sensor = rig.sensors[block.index];
  if (sensor.mount == Mount::probe) return sensor.kind == SensorKind::projector ? "rig: projector" : "rig: camera";
  return block.kind == BlockId::Kind::lens ? "rig: lenses of the trackers" : "rig: places of the trackers";
}

// The trackers' scale is the factor common to their distances from the first one, by least squares over their
// translations. Of `row`: what goes through that factor alone, as a row by the mounts.
Eigen::RowVectorXd through_tracker_scale(const Eigen::RowVectorXd& row, const Layout& layout, const Rig& rig) {
  Eigen::RowVectorXd stretch = Eigen::RowVectorXd::Zero(layout.size);
  for (const BlockId& block : layout.blocks) {
    if (block.kind != BlockId::Kind::mount || rig.sensors[block.index].mount != Mount::world) continue;
    stretch.segment<3>(layout.columns.at(block) + 3) = rig.sensors[block.index].sensor_from_mount.translation;
  }
  return row.dot(stretch) / stretch.squaredNorm() * stretch;
}

// Of the rig's sources, by themselves: what is correlated between them makes up a line of its own.
void add_rig_budget(const Eigen::RowVectorXd& row, const Eigen::MatrixXd& covariance, const Layout& layout,
                    const Rig& rig, Way& way) {
  std::map<std::string, Eigen::RowVectorXd> sources;
  for (const BlockId& block : layout.blocks) {
    const bool led = block.kind == BlockId::Kind::led;
    auto [found, is_new] = sources.try_emplace(source_of(block, rig), Eigen::RowVectorXd::Zero(layout.size));
    const auto size = led                                  ? 3
                      : block.kind == BlockId::Kind::mount ? 6
                                                           : rig.sensors[block.index].lens.parameter_count();
    found->second.segment(layout.columns.at(block), size) = row.segment(layout.columns.at(block), size);
  }
  const Eigen::RowVectorXd by_scale = through_tracker_scale(row, layout, rig);
  sources.at("rig: places of the trackers") -= by_scale;
  sources.emplace("rig: scale of the trackers", by_scale);
  double rest = quadratic(row, covariance);
  for (const auto& [source, part] : sources) {
    const double variance = quadratic(part, covariance);
    way.budget[source] += variance;
    rest -= variance;
  }
  way.budget["rig: correlation of these"] += rest;
}

// LED noise turns the probe about its LEDs' middle and shifts that.
void add_led_budget(const Eigen::RowVectorXd& by_pose, const Matrix6d& covariance, const Eigen::Vector3d& lever_mm,
                    Way& way) {
  Matrix6d to_middle = Matrix6d::Identity();  // the tangent of the middle's motion from the pose's
  to_middle.bottomLeftCorner<3, 3>() = -cross_matrix(lever_mm);
  const Matrix6d of_middle = to_middle * covariance * to_middle.transpose();
  const Eigen::RowVectorXd row = by_pose * to_middle.inverse();
  const double turning = quadratic(row.head<3>(), of_middle.topLeftCorner<3, 3>());
  const double shifting = quadratic(row.tail<3>(), of_middle.bottomRightCorner<3, 3>());
  way.budget["LED noise at the stations, through rotation"] += turning;
  way.budget["LED noise at the stations, through translation"] += shifting;
  way.budget["LED noise at the stations, both"] += quadratic(by_pose, covariance);
}

void add_errors(const std::vector<BallDistance>& distances, Way& way) {
  double squares = 0;
  for (const BallDistance& d : distances) squares += std::pow(d.found_mm - d.truth_mm, 2);
  way.squares += squares;
  way.count += static_cast<int>(distances.size());
  way.rms_by_seed.push_back(std::sqrt(squares / static_cast<double>(distances.size())));
}

Expected<void> by_leds_alone(const Rig& rig, const MadeCar& car, const std::vector<ObservedStation>& stations,
                             Way& way) {
  CalibrationState state{.rig = rig, .boards = {}, .world_from_board = {}, .board_of = {}, .world_from_probe = {}};
  for (const ObservedStation& station : stations) state.world_from_probe.push_back(station.world_from_probe);
  const auto distances = ball_distances(rig, state.world_from_probe, car, kLeastDistance_mm);
  if (!distances) return tl::unexpected(distances.error());
  add_errors(*distances, way);
  const Layout layout = rig_layout(state, rig.leds.size());
  const Eigen::MatrixXd covariance = rig_block_covariance(rig, layout, state);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Led& led : rig.leds) middle += led.position_mm / static_cast<double>(rig.leds.size());
  std::vector<HeldPose> poses;
  for (std::size_t s = 0; s < stations.size(); ++s) poses.push_back(held_pose(state, stations[s], s, rig, layout));
  for (const BallDistance& distance : *distances) {
    Eigen::RowVectorXd by_rig = row_of(distance, layout);
    double variance = distance.decoding_mm2;
    for (std::size_t s = 0; s < stations.size(); ++s) {
      const auto by_pose = distance.d_block.find({BlockId::Kind::station, s});
      if (by_pose == distance.d_block.end()) continue;
      by_rig += by_pose->second * poses[s].d_rig;
      variance += quadratic(by_pose->second, poses[s].covariance);
      add_led_budget(by_pose->second, poses[s].covariance, state.world_from_probe[s].rotation * middle, way);
    }
    variance += quadratic(by_rig, covariance);
    way.predicted += variance;
    way.budget["decoding of the balls"] += distance.decoding_mm2;
    add_rig_budget(by_rig, covariance, layout, rig, way);
  }
  return {};
}

// With S the covariance of everything and J the whitened Jacobian of one source's observations, |J S g'|^2 is that
// source's share of the variance g S g', and the shares of all sources add up to it.
Expected<void> by_refinement(const Rig& rig, const MadeCar& car, const StationRefinement& refined,
                             double overlap_inflation, Way& way) {
  const CalibrationState& state = refined.bundle.state;
  const auto distances = ball_distances(state.rig, state.world_from_probe, car, kLeastDistance_mm);
  if (!distances) return tl::unexpected(distances.error());
  add_errors(*distances, way);
  Layout layout = rig_layout(state, state.rig.leds.size());
  for (std::size_t s = 0; s < state.world_from_probe.size(); ++s) layout.add({BlockId::Kind::station, s}, state);
  const Eigen::MatrixXd covariance = refined.bundle.covariance.of(layout.blocks, state);
  Eigen::MatrixXd moves(layout.size, static_cast<Eigen::Index>(distances->size()));  // S g'
  for (std::size_t d = 0; d < distances->size(); ++d) {
    const Eigen::RowVectorXd row = row_of((*distances)[d], layout);
    moves.col(static_cast<Eigen::Index>(d)) = covariance * row.transpose();
    way.predicted += row.dot(moves.col(static_cast<Eigen::Index>(d))) + (*distances)[d].decoding_mm2;
    way.budget["decoding of the balls"] += (*distances)[d].decoding_mm2;
  }
  const auto views = make_views(refined.observations, {});
  for (std::size_t v = 0; v < views.size(); ++v) {
    ViewEvaluation evaluation;
    if (!views[v]->evaluate(state, true, evaluation)) continue;
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(evaluation.residuals.size(), moves.cols());
    for (std::size_t b = 0; b < views[v]->blocks().size(); ++b) {
      const Eigen::MatrixXd by_block = block_jacobian(*views[v], evaluation, state, b);
      change += by_block * moves.middleRows(layout.columns.at(views[v]->blocks()[b]), by_block.cols());
    }
    const auto group = std::find_if(refined.bundle.groups.begin(), refined.bundle.groups.end(), [&](const auto& g) {
      return g.sensor == views[v]->sensor() && g.kind == views[v]->kind();
    });
    const int dimension = views[v]->dimension();
    const double inflation = views[v]->kind() == View::Kind::overlaps ? overlap_inflation : 1;
    for (int i = 0; i < views[v]->size(); ++i) {
      if (!refined.bundle.views[v].inlier[static_cast<std::size_t>(i)]) continue;
      const bool target = views[v]->kind() == View::Kind::leds && rig.sensors[views[v]->sensor()].mount == Mount::probe;
      const std::string source = target ? "targets" : views[v]->kind() == View::Kind::leds ? "LED noise" : "overlap";
      way.budget[source] +=
          change.middleRows(dimension * i, dimension).squaredNorm() / (inflation * group->sigma_px * group->sigma_px);
    }
  }
  for (const Prior& prior : refined.priors) {
    const WhitenedPrior whitened = prior.evaluate(state);
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(whitened.residuals.size(), moves.cols());
    for (std::size_t b = 0; b < prior.blocks().size(); ++b) {
      change +=
          whitened.jacobians[b] * moves.middleRows(layout.columns.at(prior.blocks()[b]), whitened.jacobians[b].cols());
    }
    way.budget["rig"] += change.squaredNorm();
  }
  return {};
}

using Ways = std::map<std::string, Way>;

Expected<void> run_seed(const NamedCarRig& named, unsigned seed, Ways& ways) {
  const auto rig = calibrated(named.options, seed);
  if (!rig) return tl::unexpected(rig.error());
  MadeCarOptions options = named.options;
  options.targets_per_overlap = named.targets_per_overlap;
  const MadeCar car = make_car(options, 1000 + seed);
  const auto stations = placed_by(*rig, car, options.led_sigma_px);
  if (!stations) return tl::unexpected(stations.error());
  if (auto done = by_leds_alone(*rig, car, *stations, ways["1 LEDs alone"]); !done) return done;
  const StationRefinementOptions refinement{.threads = 2};
  std::vector<ObservedStation> without_targets = *stations;
  for (ObservedStation& station : without_targets) station.targets.clear();
  const auto overlap = refine_stations(*rig, without_targets, {}, refinement);
  if (!overlap) return tl::unexpected(overlap.error());
  if (auto done = by_refinement(*rig, car, *overlap, refinement.overlap_inflation, ways["2 and overlap"]); !done)
    return done;
  if (named.targets_per_overlap == 0) return {};
  const auto targets = refine_stations(*rig, *stations, car.targets, refinement);
  if (!targets) return tl::unexpected(targets.error());
  return by_refinement(*rig, car, *targets, refinement.overlap_inflation, ways["3 and targets"]);
}

Json print_ways(const std::string& rig, const Ways& ways) {
  fmt::print("\n{}\n| stations by | observed RMS, mm | predicted, mm | observed / predicted | worst seed, mm |\n", rig);
  fmt::print("|---|---:|---:|---:|---:|\n");
  Json json{{"rig", rig}, {"ways", Json::array()}};
  for (const auto& [name, way] : ways) {
    const double worst = *std::max_element(way.rms_by_seed.begin(), way.rms_by_seed.end());
    fmt::print("| {} | {:.4f} | {:.4f} | {:.2f} | {:.4f} |\n", name.substr(2), way.rms(), way.sigma(),
               way.rms() / way.sigma(), worst);
    Json budget;
    for (const auto& [source, variance] : way.budget) {
      budget[source] = std::copysign(std::sqrt(std::abs(variance) / way.count), variance);
    }
    json["ways"].push_back({{"stations_by", name.substr(2)},
                            {"rms_mm", way.rms()},
                            {"predicted_mm", way.sigma()},
                            {"rms_by_seed_mm", way.rms_by_seed},
                            {"budget_mm", budget}});
  }
  for (const auto& [name, way] : ways) {
    fmt::print("\n| error budget, {} | mm |\n|---|---:|\n", name.substr(2));
    for (const auto& [source, variance] : way.budget) {
      fmt::print("| {} | {:.4f} |\n", source, std::copysign(std::sqrt(std::abs(variance) / way.count), variance));
    }
  }
  const auto& alone = ways.at("1 LEDs alone").rms_by_seed;
  const auto& overlap = ways.at("2 and overlap").rms_by_seed;
  int better = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) better += overlap[i] < alone[i];
  fmt::print("\nwith overlap better than LEDs alone in {} of {} seeds\n", better, alone.size());
  return json;
}

int run() {
  Json rows = Json::array();
  int number = 0;
  for (const NamedCarRig& named : car_rigs()) {
    if (FLAGS_rig != 0 && FLAGS_rig != ++number) continue;
    Ways ways;
    for (int seed = FLAGS_first_seed; seed < FLAGS_first_seed + FLAGS_seeds; ++seed) {
      const auto done = run_seed(named, static_cast<unsigned>(seed), ways);
      fmt::print(stderr, "{}, seed {}{}\n", named.name, seed, done ? "" : ": " + done.error().message);
      if (!done) return 1;
    }
    rows.push_back(print_ways(named.name, ways));
  }
  std::filesystem::create_directories(std::filesystem::path(FLAGS_out).parent_path());
  std::ofstream file(FLAGS_out);
  file << Json{{"rows", rows}}.dump(2) << '\n';
  return file ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
