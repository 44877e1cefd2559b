// Made pairs of poses with the hand-eye pose they come from, for the tests and `./dev bench hand_eye`.
#pragma once

#include <random>
#include <vector>

#include "tracking/pose_pairs.h"

namespace crumple {

struct MadeHandEyeOptions {
  int poses = 20;
  double turn_deg = 40;    // largest rotation of the hand from the middle
  double spread_deg = 90;  // largest angle of the axes to the main one
  double hand_sigma_deg = 0, hand_sigma_mm = 0;
  double eye_sigma_deg = 0, eye_sigma_mm = 0;  // of the board in the eye's frame
};

struct MadeHandEye {
  Pose hand_from_eye;
  Pose world_from_board;
  std::vector<PosePair> pairs;
};

// Streams of one smooth motion: the hand's every 10 ms, the eye's every 33 ms with one missing now and then.
struct MadeStreamsOptions {
  double seconds = 20;
  double offset_s = 0;  // hand time = eye time + offset
  double hand_sigma_deg = 0, hand_sigma_mm = 0;
  double eye_sigma_deg = 0, eye_sigma_mm = 0;
  double eye_correlation = 0;  // of the eye's errors from one pose to the next
};

struct MadeStreams {
  Pose hand_from_eye;
  Pose world_from_board;
  std::vector<StampedPose> hand;
  std::vector<StampedPose> eye;
};

MadeStreams make_streams(const MadeStreamsOptions& options, std::mt19937& random);

MadeHandEye make_hand_eye(const MadeHandEyeOptions& options, std::mt19937& random);

}  // namespace crumple
