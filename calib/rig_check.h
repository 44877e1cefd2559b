// Is a rig still valid? New observations held against an earlier calibration, in the time of a coffee: a few stations
// or board placements suffice, since nothing is calibrated anew.
//
// Everything is refined under the rig's covariance as prior (calib/rig_prior.h) with the noise the rig knows, or of
// LEDs what they show with any rig (the same with a covariance 10^4 times as large), if that is more, up to five times
// as much: air and tripods are not those of the calibration. No observation is left out but what fits no rig either:
// stripe readings, which are errors of decoding, and LEDs that were misread; not where they are most of what a tracker
// read at a station, or of what was read of a tracker or an LED, for then it is that which changed. Boards may be bent.
// Then each part that can change by itself (a sensor's mount, its lens, an LED) is freed in turn: its prior is taken
// away and all refined again. What that takes off the sum of squares is chi-square distributed, as many degrees of
// freedom as the part has, where the part is unchanged (Baarda's test of one alternative at a time). A part is changed
// where that is less likely than 1 in 1000 over all parts together; of those, the one with the largest gain, less the
// logarithm of the redundancy for each degree of freedom (Schwarz, Annals of Statistics, 1978), is tested with the
// others against it freed, until the rest is unchanged.
//
// A change of the sensor whose frame is the probe's or the world's shows as a change of all others alike; it is freed
// likewise, and named where that explains the observations best. What observations do not touch is not tested.
//
// What changes while the observations are taken is no change of a part: no place of its own fits a tracker then. Where
// anything is not as it was, every tracker is given a second place of which nothing is known, from each station on in
// turn (and a third one for boards and references, which were seen nobody knows when). Where that explains more than
// the changes that were found, by the same criterion, a tracker was moved meanwhile, and the rest is tested anew with
// its two places.
//
// From how much on a change would show, with 80 % probability in the direction where least (Baarda 1968, minimal
// detectable bias): a shift d of what the prior W says of a part raises the sum of squares by d' W'(I - W C W') W d,
// which has to reach the non-centrality that the test above wants.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct PartCheck {
  BlockId block;
  std::string name;  // "tracker track1's place", "the lens of cam0", "LED b"
  double gain = 0;   // of the sum of squares, chi-square distributed where nothing changed
  int degrees = 0;
  double probability = 1;  // of such a gain or a larger one
  Eigen::VectorXd change;  // in the block's tangent, from the earlier rig to now
  std::string how_far;     // "2.31 mm and 0.040 deg", in words
  // From which a change would show: LEDs, and mounts shifted or turned. None of lenses and of what holds the frame.
  std::optional<double> would_show_mm = {};
  std::optional<double> would_show_deg = {};
};

// A part that changed, or one of the others that would explain the observations as well: two trackers alone cannot tell
// which of them was moved.
struct PartChange {
  std::size_t part = 0;  // of RigCheck::parts
  std::vector<std::size_t> or_else = {};
};

// A tracker that stood elsewhere from some station on, or one of several that may have.
struct MovedMeanwhile {
  std::string what;                   // in words, all that may have
  std::vector<std::string> trackers;  // by name, the likeliest first
  std::size_t first_station = 0;      // of the likeliest at its new place; of the data
};

struct RigCheck {
  double square_sum = 0;            // of residuals over their sigmas and of the prior, everything unchanged
  double redundancy = 0;            // of the observations against the rig; correlated ones count as one
  std::vector<PartCheck> parts;     // every one that was tested, in the order of the rig
  std::vector<PartChange> changed;  // the most obvious first
  // By group of LEDs, how many times as much they scatter as at the calibration, where chance alone would show as much
  // once in 1000 times over all groups.
  std::map<std::string, double> noisier = {};
  double probability = 1;  // of a square sum as large as what is left once the changed parts are free
  std::optional<MovedMeanwhile> moved = {};
  bool valid() const { return changed.empty() && !moved; }
};

// Fails where the start from the rig does (calib/start_from_rig.h).
Expected<RigCheck> check_rig(const CalibrationData& data, const EarlierRig& earlier, int threads);

}  // namespace crumple
