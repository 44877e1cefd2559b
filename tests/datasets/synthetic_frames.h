// Stripe frames of a tilted plane, made by warping the patterns through a homography: what check_sequence must call
// clean, and what tests then spoil.
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "datasets/sequence_check.h"

namespace crumple {

struct SyntheticSequence {
  SequenceSetup setup;
  std::vector<ShownFrame> frames;
};

inline cv::Mat seen_by_camera(const cv::Mat& projected, cv::RNG& noise) {
  const cv::Size camera(420, 330);
  const std::vector<cv::Point2f> panel = {{0, 0}, {255, 0}, {255, 191}, {0, 191}};
  const std::vector<cv::Point2f> seen = {{22, 31}, {398, 12}, {379, 318}, {41, 290}};
  cv::Mat image;
  cv::warpPerspective(projected, image, cv::getPerspectiveTransform(panel, seen), camera, cv::INTER_LINEAR);
  image.convertTo(image, CV_32F, 170.0 / 255);
  cv::GaussianBlur(image, image, {}, 0.8);
  // Squares of a board, half of them dark.
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      if ((x / 40 + y / 40) % 2 == 1) image.at<float>(y, x) *= 0.35F;
    }
  }
  cv::Mat grain(camera, CV_32F);
  noise.fill(grain, cv::RNG::NORMAL, 12, 1.5);
  image += grain;
  image.convertTo(image, CV_8U);
  return image;
}

inline SyntheticSequence synthetic_sequence(bool inverses = true) {
  SyntheticSequence sequence;
  sequence.setup.projector = {256, 192};
  sequence.setup.where = "station 1, camera cam";
  StripeOrientation columns{0, 1, 8, 0, inverses};
  StripeOrientation rows{M_PI / 2, 1, 8, 0, inverses};
  sequence.setup.orientations = {columns, rows};
  cv::RNG noise(1);
  const auto add = [&](const FrameContent& content, const cv::Mat& projected) {
    const std::string name = fmt::format("f{:02}.png", sequence.frames.size());
    sequence.frames.push_back({content, name, seen_by_camera(projected, noise)});
  };
  for (std::size_t o = 0; o < 2; ++o) {
    for (int bit = 0; bit < 8; ++bit) {
      for (const bool inverted : {false, true}) {
        if (inverted && !inverses) continue;
        add({FrameContent::Kind::stripes, o, bit, inverted},
            draw_stripes(sequence.setup.orientations[o], sequence.setup.projector, bit, inverted));
      }
    }
  }
  add({FrameContent::Kind::white, 0, 0, false}, cv::Mat(192, 256, CV_8U, cv::Scalar(255)));
  add({FrameContent::Kind::black, 0, 0, false}, cv::Mat(192, 256, CV_8U, cv::Scalar(0)));
  return sequence;
}

}  // namespace crumple
