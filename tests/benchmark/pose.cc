// The probe's pose from LED pixels: how long one takes, and how its error compares with that of the paper's pose
// (markers triangulated, then a rigid fit) on the same spots, over distance and number of LEDs: made pixels with noise,
// and spots found in images that the renderer made.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "datasets/render/led_spots.h"
#include "datasets/render/render.h"
#include "datasets/render/sensor.h"
#include "tests/tracking/made_station.h"
#include "tracking/paper_pose.h"
#include "tracking/probe_pose.h"
#include "tracking/spots.h"

DEFINE_int32(stations, 2000, "made stations of each row");
DEFINE_int32(image_stations, 200, "rendered stations of each row");
DEFINE_int32(trackers, 2, "trackers, 1 m apart");
DEFINE_double(sigma_px, 0.05, "noise of an LED's made pixel coordinate");

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
  std::string text() const { return fmt::format("{:.3f}, {:.4f}", rotation_mrad(), translation_mm()); }
};

std::string ratio(const Errors& paper, const Errors& pixels) {
  return fmt::format("{:.2f}, {:.2f}", paper.rotation_mrad() / pixels.rotation_mrad(),
                     paper.translation_mm() / pixels.translation_mm());
}

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
  fmt::print("| {:g} | {} | {} | {} | {} | {:.1f} % | {:.1f} % |\n", distance_mm / 1000, leds, pixels.text(),
             paper.text(), ratio(paper, pixels), 100.0 * only_pixels / FLAGS_stations,
             100.0 * neither / FLAGS_stations);
  std::fflush(stdout);
}

// The station as the renderer takes it. Every LED is lit alone in a frame of its own, so that no two spots run together
// and the frame says whose spot it is: the table is about poses, not about words. Detector and blur are those of
// datasets/scenes/tracked_door.yaml. The exposure is set for the distance and the lens is focused: at every distance
// the spots are 0.8 px wide (sigma) and peak at about a third of the full well to more than all of it, where they
// saturate.
Scene scene_of(const MadeStation& station, double distance_mm, std::uint64_t seed, std::mt19937& random) {
  std::uniform_real_distribution<double> brightness(1.5, 6);  // full wells in the whole spot
  Scene scene;
  scene.seed = seed;
  scene.lighting.reference_distance_mm = distance_mm;
  SceneStation placed;
  placed.in_view = false;
  placed.world_from_probe = station.world_from_probe;
  scene.stations.push_back(placed);
  const Detector detector{
      .exposure = 1, .full_well_electrons = 10500, .read_noise_electrons = 12, .bits = 8, .offset = 0.01};
  for (const LedReading& reading : station.readings) {
    scene.tracking.trackers.push_back({station.rig.sensors[reading.view.sensor], {.blur_px = 0.8}, detector});
  }
  for (std::size_t i = 0; i < station.rig.leds.size(); ++i) {
    std::string word(station.rig.leds.size(), '0');
    word[i] = '1';
    scene.tracking.leds.push_back({station.rig.leds[i], word, brightness(random)});
    scene.tracking.frames.push_back({.kind = FrameContent::Kind::leds, .step = i});
  }
  return scene;
}

// The same spots by both measurements.
struct SpotReadings {
  LedReadings fitted;             // with the covariances of the fits
  LedReadings centre_of_gravity;  // which has no covariance: all count alike
};

// What the detector finds in the images. Only a window around the LED is rendered: the rest of its frame is dark.
SpotReadings read_images(const Scene& scene, const MadeStation& station) {
  constexpr int kWindow_px = 64;
  constexpr double kRoom = 0.01;  // full wells
  SpotReadings result;
  for (std::size_t t = 0; t < scene.tracking.trackers.size(); ++t) {
    const Detector& detector = scene.tracking.trackers[t].detector;
    const std::size_t sensor = station.readings[t].view.sensor;
    LedReading fitted{.view = {.sensor = sensor, .leds = {}, .pixels = {}}, .covariances_px2 = {}};
    LedReading gravity = fitted;
    for (std::size_t led = 0; led < scene.tracking.leds.size(); ++led) {
      std::vector<LedSpot> lit = spots_seen(scene, 0, t, led, {});
      const Eigen::Vector2d corner = lit.at(0).centre_px.array().floor() - 0.5 * kWindow_px;
      lit[0].centre_px -= corner;
      cv::Mat1f light(kWindow_px, kWindow_px, static_cast<float>(kRoom / detector.exposure));
      draw_spots(lit, detector.exposure, light);
      const SpotsFound found = find_spots(expose(detector, light, tracker_noise_seed(scene.seed, 0, t, led))).value();
      if (found.spots.size() != 1) continue;
      fitted.view.leds.push_back(led);
      fitted.view.pixels.push_back(corner + found.spots[0].pixel);
      fitted.covariances_px2.push_back(found.spots[0].covariance_px2);
      gravity.view.leds.push_back(led);
      gravity.view.pixels.push_back(corner + found.spots[0].centre_of_gravity_px);
      gravity.covariances_px2.push_back(Eigen::Matrix2d::Identity());
    }
    result.fitted.push_back(fitted);
    result.centre_of_gravity.push_back(gravity);
  }
  return result;
}

struct SpotErrors {
  double squares = 0;
  int coordinates = 0;

  void add(const LedReadings& found, const LedReadings& truth) {
    for (std::size_t t = 0; t < found.size(); ++t) {
      const LedView& view = found[t].view;
      for (std::size_t i = 0; i < view.leds.size(); ++i) {
        squares += (view.pixels[i] - truth[t].view.pixels[view.leds[i]]).squaredNorm();
        coordinates += 2;
      }
    }
  }
  double rms_px() const { return std::sqrt(squares / coordinates); }
};

void compare_in_images(int leds, double distance_mm) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> turn(-0.6, 0.6);
  Errors pixels, paper, paper_by_gravity;
  SpotErrors fitted, gravity;
  int left_out = 0;
  for (int i = 0; i < FLAGS_image_stations; ++i) {
    const MadeStation station =
        make_station({.leds = leds, .trackers = FLAGS_trackers, .distance_mm = distance_mm}, turn(random));
    const SpotReadings readings =
        read_images(scene_of(station, distance_mm, static_cast<std::uint64_t>(i), random), station);
    fitted.add(readings.fitted, station.readings);
    gravity.add(readings.centre_of_gravity, station.readings);
    const auto ours = probe_pose(station.rig, readings.fitted);
    const auto theirs = paper_pose(station.rig, readings.fitted);
    const auto theirs_by_gravity = paper_pose(station.rig, readings.centre_of_gravity);
    if (!ours || !theirs || !theirs_by_gravity) {
      ++left_out;
      continue;
    }
    pixels.add(ours->world_from_probe, station.world_from_probe);
    paper.add(theirs->world_from_probe, station.world_from_probe);
    paper_by_gravity.add(theirs_by_gravity->world_from_probe, station.world_from_probe);
  }
  fmt::print("| {:g} | {} | {:.4f}, {:.4f} | {} | {} | {} | {} | {} | {} |\n", distance_mm / 1000, leds,
             fitted.rms_px(), gravity.rms_px(), pixels.text(), paper.text(), paper_by_gravity.text(),
             ratio(paper, pixels), ratio(paper_by_gravity, pixels), left_out);
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
  fmt::print(
      "\n{} trackers 1 m apart, spots found in rendered images, {} stations each: RMS errors, px, mrad and mm; ratios "
      "to "
      "the pose from pixels\n\n"
      "| distance, m | LEDs | spots: Gaussian, centre of gravity | from pixels (Gaussian) | paper's (Gaussian) | "
      "paper's (centre of gravity) | ratio, Gaussian | ratio, centre of gravity | stations without all three |\n"
      "|---|---|---|---|---|---|---|---|---|\n",
      FLAGS_trackers, FLAGS_image_stations);
  for (const double distance_mm : {1500.0, 3000.0, 6000.0}) {
    for (const int leds : {3, 4, 5, 8, 16}) compare_in_images(leds, distance_mm);
  }
  return 0;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
