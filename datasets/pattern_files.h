// The images a projector is to show, as files.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "datasets/capture.h"
#include "recon/patterns.h"
#include "solvers/expected.h"

namespace crumple {

// The fewest bits that name every stripe of the panel. Fails where 16 do not suffice.
Expected<int> sufficient_bits(const StripeOrientation& orientation, ImageSize projector);

// White, black, then per orientation and bit, coarsest first, the pattern and its inverse (where it has one).
std::vector<FrameContent> pattern_sequence(const std::vector<StripeOrientation>& orientations);

// The image of one frame on the panel: 8 bit, 0 or 255. `content` is white, black or stripes.
cv::Mat draw_pattern(const FrameContent& content, const std::vector<StripeOrientation>& orientations,
                     ImageSize projector);

// Names in the order of the sequence when sorted: "00_white.png", "02_45deg_bit0.png", "03_45deg_bit0_inverse.png".
std::vector<std::string> pattern_file_names(const std::vector<FrameContent>& frames,
                                            const std::vector<StripeOrientation>& orientations);

// Writes every image, and patterns.yaml: the projector's size, orientations and frames in the form capture.yaml takes,
// and the file of each frame. `written` is told after each image. Fails on an orientation that does not fit the panel.
Expected<std::vector<std::string>> write_patterns(const std::filesystem::path& folder,
                                                  const std::vector<StripeOrientation>& orientations,
                                                  ImageSize projector, const std::function<void()>& written);

}  // namespace crumple
