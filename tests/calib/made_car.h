// A made car side, scanned station after station by a tracked probe, and the campaign that calibrated its rig: with
// noise but without images.
//
// The car side is a gently bulging sheet with shallow relief, 4 m long and 0.7 m high, with balls in front of it. The
// probe stands 0.8 m before it in rows of stations whose views overlap by a third. Trackers stand behind the probe, in
// two columns 2.8 m apart (the second pair 1 m below the first), 2.7 m from the probe, and each sees the whole row.
// World frame: that of the first tracker. Sensors: "cam0", "proj0", "track0", ...
#pragma once

#include <vector>

#include "calib/refine_stations.h"
#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct MadeCarOptions {
  int trackers = 2;
  ImageSize tracker_size{1024, 768};
  double tracker_focal_px = 780;
  int leds = 5;
  double led_spread_mm = 250;
  double led_sigma_px = 0.05;
  double corner_sigma_px = 0.1;
  double stripe_sigma_px = 0.1;
  double target_sigma_px = 0.05;
  // The campaign
  int campaign_stations = 30;
  int tracker_boards = 20;
  int wand_stations = 0;
  double board_scale_sigma = 20e-6;  // of each board's certificate
  int bar_poses = 0;                 // of a scale bar with a light at each end
  double bar_mm = 2000;
  double bar_sigma_mm = 0.005;
  // The car
  int columns = 10;
  int rows = 2;
  int targets_per_overlap = 0;
  int balls = 9;
};

// Lights of a scale bar at one pose.
struct MadeBar {
  std::size_t first_led = 0;
  std::size_t second_led = 0;
  double length_mm = 0;  // as certified
};

struct MadeCampaign {
  CalibrationState truth;
  CalibrationState start;  // boards of nominal scale
  Observations observations;
  std::vector<MadeBar> bars;
};

MadeCampaign make_car_campaign(const MadeCarOptions& options, unsigned seed);

// A ball as one station decoded it.
struct SeenBall {
  std::size_t ball = 0;
  std::size_t station = 0;
  std::vector<Eigen::Vector2d> camera_pixels;
  std::vector<double> coordinates_px;  // columns
};

struct MadeCar {
  CalibrationState truth;                 // the rig and the stations
  std::vector<ObservedStation> stations;  // poses are the truth's, and patches are placed by the true rig
  std::vector<RoomTarget> targets;
  std::vector<Eigen::Vector3d> balls_mm;  // true centres in the world
  std::vector<SeenBall> seen;
  double ball_radius_mm = 25;
  double ball_sigma_px = 0.1;  // of a coordinate
};

MadeCar make_car(const MadeCarOptions& options, unsigned seed);

// Starts as a capture gives them: each station posed by its LEDs with a rig, its patches placed by that rig.
Expected<std::vector<ObservedStation>> placed_by(const Rig& rig, const MadeCar& car, double led_sigma_px);

}  // namespace crumple
