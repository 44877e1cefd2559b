// Poses to start a refinement of the probe's pose from, in closed form.
//
//   - From LEDs that two trackers or more share: points nearest to their rays, then the rigid fit (Umeyama 1991).
//   - From one tracker that sees three LEDs or more: resection, by SQPnP (Terzakis & Lourakis, ECCV 2020), or by P3P
//   (Ke &
//     Roumeliotis, CVPR 2017), both OpenCV's.
//   - From a pose that one tracker alone may confuse with another: its mirror image, the tilt reversed about the line
//   of
//     sight (exact for LEDs on a plane far away, see Schweighofer & Pinz, PAMI 2006).
#pragma once

#include <optional>
#include <vector>

#include "tracking/led_sighting.h"

namespace crumple {

// All LEDs that can be had at once; the one to try first. Empty where nothing gives a pose.
std::vector<Pose> quick_starts(const std::vector<LedSighting>& sightings);

// From three LEDs at a time, so that some are free of wrong ones; at most `most`, drawn evenly from all triples. Up to
// four poses come of each triple of one tracker.
std::vector<Pose> triple_starts(const std::vector<LedSighting>& sightings, std::size_t most);

// About the line of sight of each tracker.
std::vector<Pose> mirrored(const std::vector<LedSighting>& sightings, const Pose& world_from_probe);

}  // namespace crumple
