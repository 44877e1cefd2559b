// What a pair of poses says of a hand-eye pose: by how much the chain  world <- hand <- eye <- board  misses the board.
//
// With A = world_from_hand, B = board_from_eye, X = hand_from_eye and Y = world_from_board, A X B^-1 is where the pair
// puts the board. Against Y:
//   rotation  r = log(R_A R_X R_B^-1 R_Y^-1)                        rad, world axes
//   position  p = A X b - t_Y,  b = B^-1 0 the board's origin seen by the eye     mm, world axes
// The hand's rotation errs too, and swings the board about the hand by the lever l = R_A X b: an error a of it makes
// r = a and p = a x l. What r says of p is taken off in the hand's share f of the variance of r,
//   e = p - f r x l,   var(e) = s_p^2 along l,   s_p^2 + s_r^2 f (1 - f) |l|^2 across,
// which is p given r for independent errors: of the hand's rotation (f s_r^2), of the eye's ((1 - f) s_r^2), and of the
// positions (s_p^2). So the residuals are white, and the weights are those of maximum likelihood.
#pragma once

#include <Eigen/Core>

#include "tracking/pose_pairs.h"

namespace crumple {

struct HandEyeState {
  Pose hand_from_eye;
  Pose world_from_board;
  double offset_s = 0;
};

struct HandEyeNoise {
  double rotation_rad = 1;  // s_r per axis
  double position_mm = 1;   // s_p
  double hand_share = 0;    // f
};

constexpr int kHandEyeParameters = 13;  // tangents of X and Y, then the offset

struct HandEyeResidual {
  Eigen::Vector3d rotation_rad;
  Eigen::Vector3d position_mm;
  Eigen::Vector3d lever_mm;
  Eigen::Matrix<double, 3, kHandEyeParameters> d_rotation;
  Eigen::Matrix<double, 3, kHandEyeParameters> d_position;
  Eigen::Matrix<double, 3, kHandEyeParameters> d_lever;
};

HandEyeResidual residual_of(const PosePair& pair, const HandEyeState& state);

// Of r and e, divided by their sigmas; the whitening turns with the lever but is not differentiated.
struct WhiteResidual {
  Vector6d value;
  Eigen::Matrix<double, 6, kHandEyeParameters> jacobian;
};

// `lever_mm` gives the directions along and across: the lever itself, or that of a nearby state to keep them still.
WhiteResidual whitened(const HandEyeResidual& residual, const HandEyeNoise& noise, const Eigen::Vector3d& lever_mm);

}  // namespace crumple
