// The whole chain from observations to points in the world, three ways: the closed forms alone, stage by stage (every
// part refined by itself, then tied together in closed form: what laboratories do today), and the joint refinement.
//
// Made campaigns without images; the truth is the same rig each time, boards, stations and noise are drawn anew.
// Measured are new stations of the probe: points before its camera and projector, placed in the world by its LEDs.
// Their stripe coordinates are exact, so that what shows is the error of calibration and tracking, which a surface's
// many points do not average out; and, in a row of their own, as noisy as in calibration. The first two ways pose the
// probe as the reference method does, by triangulated markers; the third from the LEDs' pixels.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "calib/calibrate.h"
#include "calib/rig_truth.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "recon/triangulate.h"
#include "solvers/closed_form/rigid_fit.h"
#include "tests/calib/made_system_data.h"
#include "tracking/paper_pose.h"
#include "tracking/probe_pose.h"

DEFINE_int32(seeds, 20, "campaigns of each rig");
DEFINE_int32(first_seed, 1, "of the first campaign");
DEFINE_string(out, "out/bench/chain.json", "the result");

namespace crumple {
namespace {

using Json = nlohmann::ordered_json;
using Points = std::vector<Eigen::Vector3d>;

constexpr int kMeasuringStations = 12;
constexpr double kDegrees = 180 / std::numbers::pi;

struct NamedRig {
  const char* name;
  MadeSystemOptions options;
};

const std::vector<NamedRig>& rigs() {
  static const std::vector<NamedRig> all{
      {"two 1024x768 trackers, 5 LEDs", {.stations = 30, .placements = 3, .tracker_placements = 20}},
      {"four 5 MP trackers, 8 LEDs",
       {.trackers = 4,
        .tracker_size = {2592, 1944},
        .tracker_focal_px = 3500,
        .leds = 8,
        .stations = 30,
        .placements = 3,
        .tracker_placements = 20}}};
  return all;
}

// What probe and trackers see while measuring, and what it is the truth of.
struct Measurement {
  MadeSystem made;
  std::vector<Points> in_probe;                             // true, by station
  std::vector<std::vector<Eigen::Vector2d>> camera_pixels;  // by station
  std::vector<std::vector<Eigen::Vector2d>> stripes_px;     // columns and rows
};

Measurement measure(MadeSystemOptions options, double stripe_sigma_px, unsigned seed) {
  Measurement m;
  options.stations = 0;
  options.wand_stations = kMeasuringStations;
  options.tracker_placements = 0;
  options.seed = seed;
  m.made = make_system(options);
  std::mt19937_64 random(seed + 7);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> depth_mm(720, 880);
  const Sensor& camera = m.made.truth.rig.sensors[0];
  const Sensor& projector = m.made.truth.rig.sensors[1];
  for (int station = 0; station < kMeasuringStations; ++station) {
    auto& points = m.in_probe.emplace_back();
    auto& pixels = m.camera_pixels.emplace_back();
    auto& stripes = m.stripes_px.emplace_back();
    for (int i = 0; i < 48; ++i) {
      const Eigen::Vector2d pixel(150 + i % 8 * 103, 110 + i / 8 * 109);
      const Eigen::Vector3d point = *camera.lens.ray(pixel) * depth_mm(random);
      const auto lit = projector.lens.project(projector.sensor_from_mount * point);
      if (!lit) continue;
      points.push_back(point);
      pixels.push_back(pixel);
      const double column = lit->x() + stripe_sigma_px * noise(random);
      stripes.emplace_back(column, lit->y() + stripe_sigma_px * noise(random));
    }
  }
  return m;
}

// Points of one station in the probe frame, by the rig as it was estimated.
Points triangulated(const Rig& rig, const Measurement& m, std::size_t station) {
  const Sensor& camera = rig.sensors[0];
  const Sensor& projector = rig.sensors[1];
  const Pose proj_from_cam = projector.sensor_from_mount * camera.sensor_from_mount.inverse();
  const StripeTriangulator columns(projector.lens, proj_from_cam, Eigen::Vector2d::UnitX());
  const StripeTriangulator rows(projector.lens, proj_from_cam, Eigen::Vector2d::UnitY());
  Points points;
  for (std::size_t i = 0; i < m.camera_pixels[station].size(); ++i) {
    const Eigen::Vector3d ray = *camera.lens.ray(m.camera_pixels[station][i]);
    std::vector<DepthReading> readings;
    const auto column = columns(ray, m.stripes_px[station][i].x());
    const auto row = rows(ray, m.stripes_px[station][i].y());
    if (column) readings.push_back({column->depth_mm, column->d_depth_d_coordinate, 0.1});
    if (row) readings.push_back({row->depth_mm, row->d_depth_d_coordinate, 0.1});
    const auto depth = weighted_depth(readings, 0.3, 25);
    points.push_back(depth ? Eigen::Vector3d(ray * depth->depth_mm) : Eigen::Vector3d::Constant(std::nan("")));
  }
  return points;
}

struct ChainErrors {
  double raw_mm = 0;    // RMS in the frame of the first tracker
  double world_mm = 0;  // after one rigid alignment of all points
  double hand_eye_mm = 0;
  double hand_eye_deg = 0;
  std::map<std::string, double> focal_px;  // of each lens, absolute
};

LedReadings readings_at(const Measurement& m, std::size_t station, double sigma_px) {
  LedReadings readings;
  for (const LedView& view : m.made.observations.leds) {
    if (view.station != station) continue;
    const Eigen::Matrix2d covariance = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    readings.push_back({view, std::vector<Eigen::Matrix2d>(view.leds.size(), covariance)});
  }
  return readings;
}

Expected<Pose> pose_of(const Rig& rig, const LedReadings& readings, bool from_pixels) {
  if (from_pixels) {
    const auto pose = probe_pose(rig, readings);
    if (!pose) return tl::unexpected(pose.error());
    return pose->world_from_probe;
  }
  const auto pose = paper_pose(rig, readings);
  if (!pose) return tl::unexpected(pose.error());
  return pose->world_from_probe;
}

double rms(const Points& a, const Points& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

Expected<ChainErrors> errors_of(const Rig& rig, const Measurement& m, double sigma_px, bool from_pixels) {
  const CalibrationState& truth = m.made.truth;
  Points found, known;
  for (std::size_t station = 0; station < m.in_probe.size(); ++station) {
    const auto pose = pose_of(rig, readings_at(m, station, sigma_px), from_pixels);
    if (!pose) return fail(fmt::format("station {}: {}", station, pose.error().message));
    const Points in_probe = triangulated(rig, m, station);
    for (std::size_t i = 0; i < in_probe.size(); ++i) {
      if (!in_probe[i].allFinite()) continue;
      found.push_back(*pose * in_probe[i]);
      known.push_back(truth.world_from_probe[station] * m.in_probe[station][i]);
    }
  }
  ChainErrors errors;
  errors.raw_mm = rms(found, known);
  const auto aligned = rigid_fit(found, known);
  if (!aligned) return tl::unexpected(aligned.error());
  Points moved;
  for (const Eigen::Vector3d& point : found) moved.push_back(*aligned * point);
  errors.world_mm = rms(moved, known);

  const auto hand_eye = hand_eye_error(rig, truth.rig);
  if (!hand_eye) return tl::unexpected(hand_eye.error());
  errors.hand_eye_mm = hand_eye->translation_mm;
  errors.hand_eye_deg = hand_eye->rotation_rad * kDegrees;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    errors.focal_px[rig.sensors[s].name] =
        std::abs(rig.sensors[s].lens.parameters()[0] - truth.rig.sensors[s].lens.parameters()[0]);
  }
  return errors;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? 0 : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

const std::vector<std::string> kWays{"closed forms", "stage by stage", "joint"};

// By way, over the campaigns.
using Series = std::map<std::string, std::vector<std::vector<double>>>;

void add(const ChainErrors& errors, const ChainErrors& noisy, std::size_t way, Series& series) {
  const auto put = [&](const std::string& name, double value) {
    auto& ways = series[name];
    ways.resize(kWays.size());
    ways[way].push_back(value);
  };
  put("world points, aligned, mm", errors.world_mm);
  put("world points, aligned, with noise of decoding, mm", noisy.world_mm);
  put("world points, raw, mm", errors.raw_mm);
  put("hand-eye, mm", errors.hand_eye_mm);
  put("hand-eye, deg", errors.hand_eye_deg);
  for (const auto& [sensor, focal_px] : errors.focal_px) put(sensor + " focal length, px", focal_px);
}

std::vector<double> ratios(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> result;
  for (std::size_t i = 0; i < a.size(); ++i) result.push_back(a[i] / b[i]);
  return result;
}

Json print_series(const std::string& rig, const Series& series) {
  Json rows = Json::array();
  fmt::print(
      "\n{}, {} seeds\n| median of | closed forms | stage by stage | joint | closed / joint | stages / joint |\n", rig,
      series.begin()->second[0].size());
  fmt::print("|---|---:|---:|---:|---:|---:|\n");
  for (const auto& [name, ways] : series) {
    const double by_closed = median(ratios(ways[0], ways[2])), by_stages = median(ratios(ways[1], ways[2]));
    fmt::print("| {} | {:.4f} | {:.4f} | {:.4f} | {:.2f} | {:.2f} |\n", name, median(ways[0]), median(ways[1]),
               median(ways[2]), by_closed, by_stages);
    rows.push_back({{"rig", rig},
                    {"name", name},
                    {"closed_forms", ways[0]},
                    {"stagewise", ways[1]},
                    {"joint", ways[2]},
                    {"median_closed_over_joint", by_closed},
                    {"median_stagewise_over_joint", by_stages}});
  }
  return rows;
}

Expected<void> run_campaign(const NamedRig& rig, unsigned seed, Series& series) {
  MadeSystemOptions options = rig.options;
  options.seed = seed;
  const MadeSystem made = make_system(options);
  const CalibrationData data = data_of(made);
  const CalibrationOptions flat{.warp = WarpChoice::off, .bundle = {.threads = 2}};
  const auto closed = closed_forms(data, flat.bundle);
  if (!closed) return fail("closed forms: " + closed.error().message);
  const auto stages = stage_by_stage(data, flat);
  if (!stages) return fail("stages: " + stages.error().message);
  const auto joint = calibrate(data, flat);
  if (!joint) return fail("joint: " + joint.error().message);
  const Measurement m = measure(options, 0, 1000 + seed);
  const Measurement with_noise = measure(options, options.stripe_sigma_px, 1000 + seed);
  const Rig* const found[] = {&closed->rig, &stages->rig, &joint->bundle.state.rig};
  std::vector<std::pair<ChainErrors, ChainErrors>> of_ways;
  for (std::size_t way = 0; way < kWays.size(); ++way) {
    const auto errors = errors_of(*found[way], m, options.led_sigma_px, way == 2);
    if (!errors) return fail(kWays[way] + ": " + errors.error().message);
    const auto noisy = errors_of(*found[way], with_noise, options.led_sigma_px, way == 2);
    if (!noisy) return fail(kWays[way] + ": " + noisy.error().message);
    of_ways.emplace_back(*errors, *noisy);
  }
  for (std::size_t way = 0; way < kWays.size(); ++way) add(of_ways[way].first, of_ways[way].second, way, series);
  return {};
}

// A seed of which one way has no result counts for none, and the run has failed.
int run() {
  Json rows = Json::array();
  bool all = true;
  for (const NamedRig& rig : rigs()) {
    Series series;
    for (int seed = FLAGS_first_seed; seed < FLAGS_first_seed + FLAGS_seeds; ++seed) {
      const auto done = run_campaign(rig, static_cast<unsigned>(seed), series);
      fmt::print(stderr, "{}, seed {}{}\n", rig.name, seed, done ? "" : ": " + done.error().message);
      all = all && done;
    }
    if (series.empty()) return 1;
    for (const Json& row : print_series(rig.name, series)) rows.push_back(row);
  }
  const auto text = json_text(Json{{"rows", rows}});
  if (!text || !write_file(FLAGS_out, *text)) return 1;
  return all ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
