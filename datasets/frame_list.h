// The `frames` list of capture.yaml: what each image of a station shows.
#pragma once

#include "datasets/capture.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// Expands the list's items into capture.frames and capture.frame_numbers and checks that each orientation's patterns
// (and inverses, where it has them) are all there and once. Needs capture's orientations; problems go to `value`.
void read_frames(const YamlValue& value, Capture& capture);

}  // namespace crumple
