// LEDs, and what the cameras fixed to the world take of them: keys that capture.yaml and scenes share.
#pragma once

#include <string>
#include <vector>

#include "datasets/capture.h"
#include "datasets/yaml_reader.h"
#include "solvers/rig.h"

namespace crumple {

// mount: probe or world; probe where it is not said.
Mount read_mount(const std::optional<YamlValue>& value);

// When an LED is lit: a quoted or plain text of 0 and 1, 2 to 1000 characters.
std::string read_word(const YamlValue& value);

// What is wrong with words taken together: of different lengths, or the same twice. Problems go to `value`.
void check_words(const std::vector<std::string>& words, const YamlValue& value);

// `tracker_frames`: {leds: N} and `ambient`, in the order the images were taken.
std::vector<FrameContent> read_tracker_frames(const YamlValue& value);

// `leds` of capture.yaml, by their names.
std::vector<CaptureLed> read_capture_leds(const YamlValue& value);

// `scale_bars`, by their names, between LEDs of the capture that are fixed to the world. Stations are not checked.
std::vector<CaptureBar> read_scale_bars(const YamlValue& value, const std::vector<CaptureLed>& leds);

}  // namespace crumple
