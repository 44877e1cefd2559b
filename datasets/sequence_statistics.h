// What a station's frames say about each other, whatever order they are in.
//
// Each pixel's intensity is scaled by the pixel's own range over the whole sequence to -1 (dark) .. 1 (lit). Between
// neighbouring Gray-code stripes exactly one bit changes, so where the pattern of one bit has an edge, every other bit
// of that orientation is steady: the next finer one is lit there and all finer ones are dark. The mean of frame b along
// the edges of frame c therefore tells whether b is where it should be, without decoding anything.
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace crumple {

struct SequenceStatistics {
  double lit_share = 0;            // of the pixels, those whose range over the sequence exceeds the threshold
  std::vector<int> edge_count;     // per frame: sharp edges found
  std::vector<double> amplitude;   // per frame: mean |value|; falls with the stripes' width against the blur
  std::vector<double> dark_share;  // per frame: pixels below 0
  cv::Mat1d along_edges;           // (c, b): the mean of frame b along the edges of frame c
  cv::Mat1d correlation;           // (a, b): of the values, about 0; -1 for a pattern and its inverse

  int band_rows = 0;              // sampled rows come in bands of so many that adjoin in the image
  std::vector<cv::Mat1b> scaled;  // per frame: 0 (dark) .. 254 (lit) of the sampled rows; empty where the frame is
  cv::Mat1b lit;                  // 255 where the range exceeds the threshold
};

// `images` are single-channel, of one size and depth; an empty one stands for a missing frame. `outliers` values at
// either end of a pixel's sorted intensities do not count for its range. Large images are sampled in bands of rows.
SequenceStatistics sequence_statistics(const std::vector<cv::Mat>& images, int outliers, double lit_threshold);

}  // namespace crumple
