// OpenCV's searches throw dice (FLANN's trees in cv::findChessboardCornersSB, k-means in cv::findCirclesGrid) whose
// state is the calling thread's: what a thread searched before would decide what it finds next. While one of these
// lives, the thread's dice start from `seed`; afterwards they are as they were.
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

namespace crumple {

class SeededDice {
 public:
  explicit SeededDice(std::uint64_t seed) : kept_(cv::theRNG()) { cv::theRNG() = cv::RNG(seed); }
  ~SeededDice() { cv::theRNG() = kept_; }
  SeededDice(const SeededDice&) = delete;
  SeededDice& operator=(const SeededDice&) = delete;

 private:
  cv::RNG kept_;
};

}  // namespace crumple
