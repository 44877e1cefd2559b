// What a tracker's images of a station show of the LEDs: spots of every frame of the blinking sequence, told apart.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "datasets/capture.h"
#include "solvers/expected.h"
#include "tracking/identify.h"

namespace crumple {

// The words that the capture's LEDs blink, in the order of Capture::leds. Fails where it has none, and where they
// cannot be told apart at every phase.
Expected<BlinkCode> blink_code_of(const Capture& capture);

// Where the probe's LEDs should be, by their names, of those of which that is said.
std::map<std::string, Eigen::Vector3d> nominal_places_mm(const Capture& capture);

// LEDs by their index in Capture::leds. Frames without a file count as missing. Fails on an image that cannot be read,
// and where no frame of the sequence is there.
Expected<Identification> read_lights(const Capture& capture, const BlinkCode& code, const std::string& camera,
                                     const std::string& station, const IdentifyOptions& options = {});

}  // namespace crumple
