// Images that are not of the tracker, or not of the station, that they are filed under.
#pragma once

#include <optional>
#include <string>

#include "tracking/identify.h"
#include "tracking/probe_pose.h"

namespace crumple {

// Whether two LEDs or more lie at the same places in both, to the last digit: two trackers never see that.
bool same_images(const Identification& one, const Identification& other);

// Why the readings of all trackers give no pose, in words: where two of them, exchanged, give one, these have each
// other's images; else where one left out the rest give one, or where each of two gives one by itself, those are of
// different times or places. A pose counts that has a redundancy of four and uses seven readings of eight. Nothing
// where none of these explains it.
std::optional<std::string> find_mixed_images(const Rig& rig, const LedReadings& readings,
                                             const ProbePoseOptions& options = {});

}  // namespace crumple
