// Where the probe was at a station of a capture, from the trackers' images and a rig.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets/capture.h"
#include "solvers/expected.h"
#include "tracking/constellation.h"
#include "tracking/stillness.h"

namespace crumple {

// Whether the rig's probe is tracked and the capture shows its LEDs: then its clouds can be put into the world.
bool is_tracked(const Capture& capture, const Rig& rig);

// The poses by which the probe can be placed: from the LEDs' pixels in all trackers at once, or as the reference method
// does it, from triangulated markers (tracking/paper_pose.h; without a covariance), by their spots' centres of gravity
// or by the refined spots.
enum class PoseMethod { pixels, markers, markers_by_spots };

struct StationPose {
  Constellation constellation;
  Stillness stillness;  // of the LEDs between the repetitions of their words
};

// `near` decides where the pixels leave several poses (tracking/probe_pose.h); markers leave none.
//
// From all trackers that the rig knows and that took images there; what capture.yaml excludes is left out. Fails,
// naming the station, on LEDs that the rig does not have, on an image that cannot be read, where the lights give no
// pose, and where probe or trackers moved between the repetitions: a scan in between is spoilt then.
Expected<StationPose> station_pose(const Capture& capture, const Rig& rig, const std::string& station,
                                   PoseMethod method = PoseMethod::pixels, const std::optional<NearPose>& near = {});

}  // namespace crumple
