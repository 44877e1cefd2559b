#include "tests/tracking/opencv_hand_eye.h"

#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace crumple {

Pose opencv_hand_eye(const std::vector<PosePair>& pairs, std::size_t method) {
  std::vector<cv::Mat> hand_rotation, hand_translation, board_rotation, board_translation;
  const auto add = [](const Pose& pose, std::vector<cv::Mat>& rotations, std::vector<cv::Mat>& translations) {
    cv::eigen2cv(Eigen::Matrix3d(pose.rotation.toRotationMatrix()), rotations.emplace_back());
    cv::eigen2cv(pose.translation, translations.emplace_back());
  };
  for (const PosePair& pair : pairs) {
    add(pair.world_from_hand, hand_rotation, hand_translation);
    add(pair.board_from_eye.inverse(), board_rotation, board_translation);
  }
  Pose pose{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  try {
    cv::Mat rotation, translation;
    cv::calibrateHandEye(hand_rotation, hand_translation, board_rotation, board_translation, rotation, translation,
                         static_cast<cv::HandEyeCalibrationMethod>(method));
    Eigen::Matrix3d r;
    cv::cv2eigen(rotation, r);
    cv::cv2eigen(translation, pose.translation);
    pose.rotation = Eigen::Quaterniond(r).normalized();
  } catch (const cv::Exception&) {
  }
  return pose;
}

}  // namespace crumple
