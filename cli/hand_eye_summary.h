// What `crumple calibrate --hand_eye` says: summary.json (docs/formats.md) and a page of text.
#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tracking/hand_eye_verdict.h"

namespace crumple {

// Without streams: of poses that came as pairs.
nlohmann::json hand_eye_summary(const HandEyeCalibration& calibration, const std::optional<PairedStreams>& streams,
                                const HandEyeVerdict& verdict);

std::string hand_eye_text(const HandEyeCalibration& calibration, const HandEyeVerdict& verdict);

}  // namespace crumple
