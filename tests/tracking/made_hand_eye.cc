#include "tests/tracking/made_hand_eye.h"

#include <cmath>
#include <numbers>

namespace crumple {
namespace {

constexpr double kRadian = std::numbers::pi / 180;

// std::normal_distribution differs between libraries; this does not.
double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) + 0.5) / 4294967296.0;
}

double normal(std::mt19937& random) {
  const double radius = std::sqrt(-2 * std::log(uniform(random, 0, 1)));
  return radius * std::cos(uniform(random, 0, 2 * std::numbers::pi));
}

Eigen::Vector3d normals(std::mt19937& random, double sigma) {
  const double x = normal(random), y = normal(random), z = normal(random);
  return sigma * Eigen::Vector3d(x, y, z);
}

Eigen::Vector3d direction(std::mt19937& random) { return normals(random, 1).normalized(); }

// Within an angle of a main axis.
Eigen::Vector3d direction_near(const Eigen::Vector3d& main, double angle_rad, std::mt19937& random) {
  const Eigen::Vector3d side = main.cross(direction(random)).normalized();
  const double tilt = uniform(random, -angle_rad, angle_rad);
  return std::cos(tilt) * main + std::sin(tilt) * side;
}

Pose with_noise(const Pose& pose, double sigma_deg, double sigma_mm, std::mt19937& random) {
  Vector6d step;
  step << normals(random, sigma_deg * kRadian), normals(random, sigma_mm);
  return retract(pose, step);
}

}  // namespace

MadeHandEye make_hand_eye(const MadeHandEyeOptions& o, std::mt19937& random) {
  MadeHandEye made;
  made.hand_from_eye = {rotation_from_vector(uniform(random, 0, 3) * direction(random)),
                        uniform(random, 20, 200) * direction(random)};
  made.world_from_board = {rotation_from_vector(uniform(random, 0, 3) * direction(random)),
                           uniform(random, 0, 2000) * direction(random)};
  const Eigen::Vector3d main = direction(random);
  // The eye looks at the board from about a metre, upright on it, before the hand turns.
  const Pose middle{rotation_from_vector({std::numbers::pi, 0, 0}), {0, 0, uniform(random, 700, 1200)}};
  for (int i = 0; i < o.poses; ++i) {
    const double angle = uniform(random, -o.turn_deg, o.turn_deg) * kRadian;
    const Pose turn{rotation_from_vector(angle * direction_near(main, o.spread_deg * kRadian, random)),
                    normals(random, 60)};
    const Pose eye_from_board = turn * middle;
    PosePair pair;
    pair.time_s = i;
    pair.board_from_eye = with_noise(eye_from_board, o.eye_sigma_deg, o.eye_sigma_mm, random).inverse();
    pair.world_from_hand = with_noise(made.world_from_board * eye_from_board.inverse() * made.hand_from_eye.inverse(),
                                      o.hand_sigma_deg, o.hand_sigma_mm, random);
    made.pairs.push_back(pair);
  }
  return made;
}

MadeStreams make_streams(const MadeStreamsOptions& o, std::mt19937& random) {
  MadeStreams made;
  made.hand_from_eye = {rotation_from_vector(uniform(random, 0, 3) * direction(random)), 80 * direction(random)};
  made.world_from_board = {rotation_from_vector(uniform(random, 0, 3) * direction(random)), 900 * direction(random)};
  Eigen::Matrix<double, 6, 3> phases;
  for (Eigen::Index i = 0; i < 18; ++i) phases.data()[i] = uniform(random, 0, 2 * std::numbers::pi);
  const auto eye_from_board = [&](double t) {
    Vector6d wave;
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto k = static_cast<double>(i);
      wave[i] = std::sin((1.1 + 0.17 * k) * t + phases(i, 0)) + 0.6 * std::sin((2.3 - 0.21 * k) * t + phases(i, 1)) +
                0.3 * std::sin((4.1 + 0.13 * k) * t + phases(i, 2));
    }
    const Pose middle{rotation_from_vector({std::numbers::pi, 0, 0}), {0, 0, 900}};
    return Pose{rotation_from_vector(0.4 * wave.head<3>()), 60 * wave.tail<3>()} * middle;
  };
  for (double t = -0.5; t < o.seconds + 0.5; t += 0.01) {
    const Pose pose = made.world_from_board * eye_from_board(t).inverse() * made.hand_from_eye.inverse();
    made.hand.push_back({t + o.offset_s, with_noise(pose, o.hand_sigma_deg, o.hand_sigma_mm, random)});
  }
  Vector6d error = Vector6d::Zero();
  const double fresh = std::sqrt(1 - o.eye_correlation * o.eye_correlation);
  for (double t = 0; t < o.seconds; t += 1.0 / 30) {
    Vector6d step;
    step << normals(random, o.eye_sigma_deg * kRadian), normals(random, o.eye_sigma_mm);
    error = o.eye_correlation * error + fresh * step;
    if (uniform(random, 0, 1) < 0.05) continue;
    made.eye.push_back({t, retract(eye_from_board(t), error).inverse()});
  }
  return made;
}

}  // namespace crumple
