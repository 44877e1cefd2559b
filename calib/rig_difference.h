// Has a rig changed between two calibrations, where, and by more than their uncertainties say?
//
// Sensors and LEDs are matched by name. Compared are
//   each sensor's projection    px over its image, after the best motion of its frame (calib/projection_difference.h)
//   each pair of one mount      mm of what both measure in the volume, likewise (calib/volume_difference.h)
//   the probe's LEDs            mm, after their best motion; and what the first pair on the probe measures, carried by
//                               the LEDs
// so a lens that changed shows in the first, a sensor that moved against another in the second, and one that moved
// against the LEDs in the last. Each is one chi-square test. A difference is significant at k where its probability
// under noise alone is below that of a normal distribution outside of k standard deviations, divided by the number of
// tests (Bonferroni): two calibrations of an unchanged rig are found different no more often than that.
//
// The calibrations are taken as independent: of one that went on from the other (calib/start_from_rig.h) the difference
// is smaller than both uncertainties make it look, and what is significant then is so all the more. Of one made from a
// part of the other's views the covariance of the difference is known (calib/fold_differences.h): given to the one rig
// and none to the other, it is what this compares with.
#pragma once

#include <string>
#include <vector>

#include "calib/projection_difference.h"
#include "calib/volume_difference.h"

namespace crumple {

struct RigDifferenceOptions {
  double k = 2;
  std::optional<VolumeDepth> depth = {};  // else where the sensors' axes come closest
  int columns = 16;                       // of each sensor's grid
  int rows = 12;
  // Smaller ones count as none.
  double no_difference_px = kNoDifference_px;
  double no_difference_mm = kNoDifference_mm;
};

struct ParameterDrift {
  std::string name;   // "cam0.fx"
  double change = 0;  // B minus A
  double sigma = 0;   // of that, from both
};

struct SensorDrift {
  std::string sensor;
  ImageSize size;
  std::string model_a, model_b;
  double distance_mm = 0;  // may be infinite
  ProjectionDifference projection;
  std::vector<ParameterDrift> parameters = {};  // of the lens, where both have the same model
  bool significant = false;
};

struct PairDrift {
  std::string first, second;
  VolumeDepth depth;
  VolumeDifference volume;
  double turned_rad = 0;  // of second_from_first, B against A; what a lens takes up is in it too
  double shifted_mm = 0;
  bool significant = false;
};

struct LedDrift {
  std::string first, second;  // of the pair whose measurements they carry; empty without one
  LedDifference leds;
  bool shape_significant = false;
  bool carried_significant = false;
};

struct RigDifference {
  double k = 0;
  int tests = 0;
  std::vector<SensorDrift> sensors;
  std::vector<PairDrift> pairs;
  std::optional<LedDrift> leds;
  std::vector<std::string> only_a, only_b;  // sensors and LEDs
  std::vector<std::string> not_compared;    // and why, a sentence each
  bool depth_unknown = false;               // a pair was not, for want of RigDifferenceOptions::depth
  std::vector<std::string> changed;         // what is significant, in words, the likely cause first

  bool significant() const { return !changed.empty(); }
};

// Fails where a rig has no covariance or the rigs have nothing in common.
Expected<RigDifference> rig_difference(const Rig& a, const Rig& b, const RigDifferenceOptions& options);

}  // namespace crumple
