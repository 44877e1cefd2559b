// What a pixel's neighbourhood, of which it is a small part, says of its stripe coordinate: for judging a coordinate by
// its phase with hardly any of the pixel's own noise in that phase. As information is greatest at the stripes'
// boundaries, noise that happens to move a coordinate towards one makes it look better known than it is.
#pragma once

#include <opencv2/core/mat.hpp>

namespace crumple {

struct PhaseNeighbourhoods {
  cv::Mat u;       // CV_64F, on the plane through the neighbours, or their mean where all are there
  cv::Mat sigma;   // CV_32F, their root mean square; 0 where they do not tell, or the pixel has no coordinate
  cv::Mat slopes;  // CV_32FC2, of the plane
};

// `u`: CV_64F stripe widths from the origin; `sigma`: CV_32F of u, 0 where there is no coordinate.
PhaseNeighbourhoods phase_neighbourhoods(const cv::Mat& u, const cv::Mat& sigma);

}  // namespace crumple
