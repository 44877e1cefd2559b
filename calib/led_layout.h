// Are the probe's LEDs where the drawing has them? A wrong word, or two that are swapped, makes a constellation that no
// residual contradicts as long as nothing else knows it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/rig.h"

namespace crumple {

// Sentences on what is wrong, empty where nothing is: after one rigid motion of all LEDs onto their nominal places (by
// their names, in any frame) two that would fit three times better for each other are swapped; otherwise the RMS
// distance must not exceed `tolerance_mm`. Nothing is said of fewer than four LEDs with nominal places.
std::vector<std::string> check_led_layout(const Rig& rig, const std::map<std::string, Eigen::Vector3d>& nominal_mm,
                                          double tolerance_mm = 5);

}  // namespace crumple
