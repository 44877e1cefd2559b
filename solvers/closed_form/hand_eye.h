// The pose of an eye on the hand that carries it, from motions of both: A X = X B.
//
// Source: R. Horaud & F. Dornaika, Hand-eye calibration, IJRR 14(3), 1995, the closed form that solves for rotation,
// then translation. With A and B a motion of hand and eye, X = hand_from_eye:
//   R_A R_X = R_X R_B   gives  n_A = R_X n_B  for the unit axes of the two rotations, and
//   (R_A - I) t_X = R_X t_B - t_A.
// The rotation minimises sum |n_A - R_X n_B|^2. As a unit quaternion q that is |n_A q - q n_B|^2 = q' D'D q with
//   D = [ 0            -(n_A - n_B)'   ]
//       [ n_A - n_B    [n_A + n_B]x    ],
// and with a Lagrange multiplier for |q| = 1 the smallest eigenvalue of sum D'D and its eigenvector. Orders and signs
// are those of solvers/pose.h, derived anew and proven on made poses, not copied: texts of the method differ in them.
// The translation follows by linear least squares. Every motion counts alike, so small rotations, whose axes are noise,
// should be left out by the caller (tracking/motion_selection.h).
//
// Degenerate where no two rotations have different axes (then the turn and the shift along the common axis are free)
// and where the rotations are too small. Both are measured against the noise that the motions show themselves, an angle
// of rotation being the same for hand and eye: below twice the RMS difference of the angles they are refused (noise
// alone makes up to root two of it).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

// The hand frame at one time from the hand frame at another, and the same of the eye.
struct HandEyeMotion {
  Pose hand;
  Pose eye;
};

// What the motions tell: of `turn` = 2 sin(angle / 2), in rad for small angles, along its axis.
struct MotionConditioning {
  double turn_rad = 0;                                   // RMS
  double cross_turn_rad = 0;                             // RMS of the part across the main axis: the other axes' share
  double disagreement_rad = 0;                           // RMS difference of the two angles of a motion
  Eigen::Vector3d main_axis = Eigen::Vector3d::UnitZ();  // in the hand frame
};

MotionConditioning conditioning_of(const std::vector<HandEyeMotion>& motions);

// Why the motions do not determine the pose; passes where they do.
Expected<void> check_conditioning(const MotionConditioning& conditioning);

struct HandEyeStart {
  Pose hand_from_eye;
  double axis_rms_rad = 0;  // of |n_A - R_X n_B|
  MotionConditioning conditioning;
};

// Motions by half a turn or nearly, whose axis has no sign, and by nothing count for the translation only. Fails with
// fewer than two motions and, in words, on the degeneracies above.
Expected<HandEyeStart> hand_eye_start(const std::vector<HandEyeMotion>& motions);

}  // namespace crumple
