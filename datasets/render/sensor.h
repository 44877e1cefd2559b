// From radiance to the numbers a camera delivers: exposure, shot and read noise, saturation, quantisation.
#pragma once

#include <cstdint>

#include <opencv2/core/mat.hpp>

#include "datasets/render/scene.h"

namespace crumple {

// Photons are counted (Poisson, by its normal limit from 50 electrons on), the amplifier adds its noise, and the sum is
// cut to `bits` bits. CV_8U for 8 bits, else CV_16U. Every row draws from its own stream of `seed`, so that the bits
// depend neither on the order nor on the number of threads.
cv::Mat expose(const Detector& detector, const cv::Mat1f& radiance, std::uint64_t seed);

// The largest code of the images, 255 or 65535, and the code that a number of electrons gives on average.
double saturation_code(const Detector& detector);
double code_from_electrons(const Detector& detector, double electrons);

}  // namespace crumple
