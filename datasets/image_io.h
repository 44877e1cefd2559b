// Images on disk: 8 and 16 bit PNG, TIFF, BMP, PGM/PPM and JPEG become single-channel CV_8U or CV_16U.
//
// Grey images are handed out untouched. Colour images become linear light: sRGB's curve is undone (IEC 61966-2-1) where
// the file holds sRGB values, the channels are weighted by Rec. 709 (0.2126 R + 0.7152 G + 0.0722 B), and the result
// fills 16 bits. An alpha channel is ignored, and so is any orientation a JPEG states: pixels stay where the sensor
// had them.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <opencv2/core/mat.hpp>

#include "solvers/expected.h"

namespace crumple {

enum class ColourEncoding {
  srgb,   // values follow sRGB's curve, as cameras' JPEGs do
  linear  // values are proportional to light, as many industrial cameras' files are
};

// Fails on a missing, empty, truncated or damaged file and on depths other than 8 and 16 bit.
Expected<cv::Mat> read_image(const std::filesystem::path& file, ColourEncoding colour = ColourEncoding::srgb);

// The same from memory; `name` stands for the file in errors.
Expected<cv::Mat> decode_image(std::span<const unsigned char> bytes, const std::string& name,
                               ColourEncoding colour = ColourEncoding::srgb);

// Grey CV_8U or CV_16U, or colour CV_8UC3 in OpenCV's order, as PNG, by way of a temporary file that is renamed.
Expected<std::filesystem::path> write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace crumple
