// Whether a station's frames show what the description says, in that order.
//
// The edges of the coarser patterns say what every finer frame must show there (sequence_statistics.h), a pattern and
// its inverse must complement each other, white and black must be lit and dark. Each of these is a term between -1 and
// 1. Where the order as described violates terms, other orders are tried (a pair swapped, two frames exchanged, a frame
// dropped or repeated with the later ones shifted, inverses first, finest bit first, one bad frame) and the simplest
// that violates none is named. Where single frames are bad for no reason that can be seen, or no order explains them,
// and the frames are of two places, as after a push (motion_check.h), the order is not to blame and nothing is said.
// Where the push would be in the first or the last pair, or further than shifts can be measured, it cannot be told from
// another image, and both are named.
//
// The coarsest bit has no coarser one to be checked by. With two orientations or more its sign follows from handedness
// (camera and projector look at the same side of the scene, so the map between their pixels does not mirror), and from
// codes that no stripe has.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "datasets/capture.h"
#include "datasets/finding.h"

namespace crumple {

struct ShownFrame {
  FrameContent content;
  std::string name;  // as findings call it
  cv::Mat image;     // empty where it is missing
};

struct SequenceSetup {
  std::vector<StripeOrientation> orientations;
  ImageSize projector;
  double full_scale = 255;  // of the images' values
  std::string where;        // of the findings
};

// The images present are single-channel, of one size and depth. Without stripes only white and black are compared.
std::vector<Finding> check_sequence(const std::vector<ShownFrame>& frames, const SequenceSetup& setup);

}  // namespace crumple
