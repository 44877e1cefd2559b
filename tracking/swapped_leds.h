// Two LEDs that blink each other's words: what all trackers read of one is the other.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>

#include "solvers/expected.h"
#include "tracking/probe_pose.h"

namespace crumple {

// Of the probe's LEDs that `pose` uses no reading of (all that are read, where there is no pose) the two that,
// exchanged, give a pose with redundancy that uses every reading of both; of several pairs the one whose pose uses most
// readings, then that of the least chi-square. None where there is no such pair. `pose` is what probe_pose() makes of
// the readings with the same options.
std::optional<std::pair<std::size_t, std::size_t>> find_swapped_leds(const Rig& rig, const LedReadings& readings,
                                                                     const Expected<ProbePose>& pose,
                                                                     const ProbePoseOptions& options = {});

}  // namespace crumple
