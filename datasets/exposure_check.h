// Whether frames are exposed so that something can be measured in them.
//
// Error: a frame that should show light is dark (99.9 % of its pixels below 2 % of full scale), or a quarter of a frame
// is saturated. Warning: 1 % of a frame is saturated (those pixels are lost, usually on glints), or the brightest 1 %
// of the white or ambient frame starts below 10 % of full scale (quantisation and read noise rule).
#pragma once

#include <vector>

#include "datasets/finding.h"
#include "datasets/sequence_check.h"

namespace crumple {

// The largest value the sensor could have given: 255, or for 16 bit images the smallest of 1023, 4095, 16383 and 65535
// that no image exceeds, since 10 to 14 bit data are often stored so.
double full_scale_of(const std::vector<ShownFrame>& frames);

std::vector<Finding> check_exposure(const std::vector<ShownFrame>& frames, double full_scale, const std::string& where);

}  // namespace crumple
