// Poses of stations refined together, from everything that ties them: the LEDs' pixels in all trackers, the surface
// where stations overlap (solvers/overlap_residuals.h), and targets in the room that the probe's cameras see. The rig
// is free under its own covariance (calib/rig_prior.h): with the rig held, what it gets wrong would be pressed into the
// poses, and overlap would carry that from station to station.
//
//   1. LEDs alone, the rig free: the start, and what the result is held against.
//   2. Overlaps are looked for with these poses, everything is refined, and both once more with the new poses.
//
// Overlap alone never poses a station: stations that overlap each other but of which no LEDs are read are refused. Nor
// is overlap believed against the LEDs: where it raises what LEDs and rig object (their sum of squares, in the sigmas
// that LEDs alone show) by more than the freedom it takes explains, it is refused as a contradiction.
//
// Frames: world_from_probe as everywhere. Covariances hold the rig's share, as the rig's own covariance states it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "recon/overlap.h"
#include "solvers/bundle.h"
#include "tracking/led_reading.h"

namespace crumple {

// What one camera and the projector measured at a station. Indices are of the rig.
struct StationSurface {
  std::size_t camera = 0;
  std::size_t projector = 0;
  Eigen::Vector2d stripe_normal = Eigen::Vector2d::UnitX();
  std::vector<SurfacePatch> patches;
};

// Targets as one camera saw them; `targets` are indices of the targets given.
struct TargetReading {
  std::size_t camera = 0;
  std::vector<std::size_t> targets;
  std::vector<Eigen::Vector2d> pixels;
};

struct ObservedStation {
  std::string name;
  Pose world_from_probe;      // of its LEDs, or roughly
  LedReadings readings = {};  // of the probe's LEDs; sigmas are told anew, by tracker
  std::vector<StationSurface> surfaces = {};
  std::vector<TargetReading> targets = {};
};

// A point fixed to the room; where it is, roughly. It has to be seen from two stations; one of which no two readings
// agree says nothing.
struct RoomTarget {
  std::string name;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
};

struct StationRefinementOptions {
  OverlapOptions overlap = {};
  std::size_t least_pairs = 30;  // that make an overlap
  // Readings of one surface are correlated beyond a patch's pixels: so many count as one.
  double overlap_inflation = 4;
  bool reject_outliers = true;
  int threads = 1;
};

struct RefinedStation {
  Pose world_from_probe;
  Matrix6d covariance = Matrix6d::Zero();
  Pose by_leds;  // the station's pose from LEDs alone
  Matrix6d covariance_by_leds = Matrix6d::Zero();
  Vector6d shift = Vector6d::Zero();  // from the one to the other
  double shift_sigmas = 0;            // its length over six directions, in sigmas of LEDs alone
  std::size_t overlaps = 0;           // stations it shares surface with
};

struct StationRefinement {
  std::vector<RefinedStation> stations = {};  // in the order given
  std::vector<RoomTarget> targets = {};       // likewise; one that says nothing is where it was given
  std::size_t targets_used = 0;
  std::size_t overlaps = 0;  // pairs of stations
  std::size_t pairs = 0;     // of patches
  // By how much LEDs and rig fit worse than by themselves, and the freedom that explains as much.
  double contradiction_square = 0;
  int contradiction_freedom = 0;
  BundleResult by_leds;
  BundleResult bundle;
  // What the last refinement was given: of bundle.views and of the rig's prior.
  Observations observations;
  std::vector<Prior> priors;
};

// Fails on a rig without a covariance, on readings of targets that are not given, and as above.
Expected<StationRefinement> refine_stations(const Rig& rig, const std::vector<ObservedStation>& stations,
                                            const std::vector<RoomTarget>& targets,
                                            const StationRefinementOptions& options);

}  // namespace crumple
