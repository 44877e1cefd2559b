// The probe's pose from LED pixels: how long one takes, and how its error compares with that of the paper's pose
// (markers triangulated, then a rigid fit) on the same spots, over distance and number of LEDs.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "tests/tracking/made_station.h"
#include "tracking/paper_pose.h"
#include "tracking/probe_pose.h"

DEFINE_int32(stations, 2000, "made stations of each row");
DEFINE_int32(trackers, 2, "trackers, 1 m apart");
DEFINE_double(sigma_px, 0.05, "noise of an LED's pixel coordinate");

namespace crumple {
namespace {

struct Errors {
  double rotation = 0, translation = 0;  // sums of squares
  int poses = 0;

  void add(const Pose& found, const Pose& truth) {
    const Vector6d step = local_step(truth, found);
    rotation += step.head<3>().squaredNorm();
    translation += step.tail<3>().squaredNorm();
    ++poses;
  }
  double rotation_mrad() const { return 1e3 * std::sqrt(rotation / poses); }
  double translation_mm() const { return std::sqrt(translation / poses); }
};

// Each LED hidden from each tracker with that probability.
LedReadings partly_hidden(const LedReadings& readings, double hidden, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  LedReadings result;
  for (const LedReading& reading : readings) {
    LedReading seen{.view = {.sensor = reading.view.sensor, .leds = {}, .pixels = {}}, .covariances_px2 = {}};
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      if (uniform(random) < hidden) continue;
      seen.view.leds.push_back(reading.view.leds[i]);
      seen.view.pixels.push_back(reading.view.pixels[i]);
      seen.covariances_px2.push_back(reading.covariances_px2[i]);
    }
    result.push_back(seen);
  }
  return result;
}

void compare(int leds, double distance_mm, double hidden) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> turn(-0.6, 0.6);
  Errors pixels, paper;
  int only_pixels = 0, neither = 0;
  for (int i = 0; i < FLAGS_stations; ++i) {
    const MadeStation station =
        make_station({.leds = leds, .trackers = FLAGS_trackers, .distance_mm = distance_mm, .sigma_px = FLAGS_sigma_px},
                     turn(random));
    const LedReadings readings = partly_hidden(with_noise(station.readings, random), hidden, random);
    const auto ours = probe_pose(station.rig, readings);
    const auto theirs = paper_pose(station.rig, readings);
    only_pixels += ours && !theirs;
    neither += !ours && !theirs;
    if (!ours || !theirs) continue;
    pixels.add(ours->world_from_probe, station.world_from_probe);
    paper.add(theirs->world_from_probe, station.world_from_probe);
  }
  const double rotations = paper.rotation_mrad() / pixels.rotation_mrad();
  const double translations = paper.translation_mm() / pixels.translation_mm();
  fmt::print("| {:g} | {} | {:.3f}, {:.4f} | {:.3f}, {:.4f} | {:.2f}, {:.2f} | {:.1f} % | {:.1f} % |\n",
             distance_mm / 1000, leds, pixels.rotation_mrad(), pixels.translation_mm(), paper.rotation_mrad(),
             paper.translation_mm(), rotations, translations, 100.0 * only_pixels / FLAGS_stations,
             100.0 * neither / FLAGS_stations);
  std::fflush(stdout);
}

template <typename Work>
double microseconds(const Work& work) {
  double best = 1e9;
  for (int turn = 0; turn < 7; ++turn) {
    constexpr int kCalls = 200;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kCalls; ++i) work(i);
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / kCalls);
  }
  return 1e6 * best;
}

void time_one(int leds, int trackers, bool wrong_id) {
  const MadeStation station = make_station({.leds = leds, .trackers = trackers, .sigma_px = FLAGS_sigma_px});
  std::mt19937 random(1);
  std::vector<LedReadings> readings;
  for (int i = 0; i < 200; ++i) {
    readings.push_back(with_noise(station.readings, random));
    if (wrong_id) std::swap(readings.back()[0].view.pixels[0], readings.back()[0].view.pixels[3]);
  }
  int failed = 0;
  const double ours =
      microseconds([&](int i) { failed += !probe_pose(station.rig, readings[static_cast<std::size_t>(i)]); });
  const double theirs = microseconds(
      [&](int i) { failed += trackers > 1 && !paper_pose(station.rig, readings[static_cast<std::size_t>(i)]); });
  fmt::print("| {} LEDs, {} trackers{} | {:.0f} | {} | {} |\n", leds, trackers, wrong_id ? ", two IDs swapped" : "",
             ours, trackers > 1 && !wrong_id ? fmt::format("{:.0f}", theirs) : "-", failed);
}

int run() {
  fmt::print("| microseconds per pose (best of 7 runs of 200) | from pixels | paper's | failed |\n|---|---|---|---|\n");
  for (const int trackers : {1, 2, 4}) time_one(8, trackers, false);
  time_one(8, 4, true);
  for (const double hidden : {0.0, 0.3}) {
    fmt::print(
        "\n{} trackers 1 m apart, {:g} px, {:g} % of the LEDs hidden from a tracker, {} stations each: RMS errors, "
        "mrad and "
        "mm\n\n| distance, m | LEDs | from pixels | paper's | ratio | only from pixels | neither |\n"
        "|---|---|---|---|---|---|---|\n",
        FLAGS_trackers, FLAGS_sigma_px, 100 * hidden, FLAGS_stations);
    for (const double distance_mm : {1500.0, 3000.0, 6000.0}) {
      for (const int leds : {3, 4, 6, 8, 16}) compare(leds, distance_mm, hidden);
    }
  }
  return 0;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
