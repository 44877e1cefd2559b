// How a station's pose was taken where its LEDs leave several (tracking/probe_pose.h): for summaries (docs/formats.md,
// `choice`) and in words.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tracking/probe_pose.h"

namespace crumple {

nlohmann::json choice_json(const PoseChoice& choice);
// "1 of 2 poses that explain the pixels, turned by ..."
std::string choice_text(const PoseChoice& choice);

}  // namespace crumple
