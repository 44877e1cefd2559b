// Clouds as images: parallel projection with hidden points removed.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "recon/cloud.h"

namespace crumple {

// Pixels = scale * (axes * (point - centre)) + offset, depth along the third axis, away from the viewer.
struct CloudView {
  Eigen::Matrix3d view_from_cloud = Eigen::Matrix3d::Identity();  // rows: right, down, away
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double px_per_mm = 1;
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
};

// The broad side, seen a little from above and from the side, as large as fits into the size. Precondition: points.
CloudView choose_view(const Cloud& cloud, cv::Size size);

struct CloudImage {
  cv::Mat1f weight;  // 0 where there is nothing
  cv::Mat1f value;   // means over the points that show in a pixel
  cv::Mat3f normal;  // in the view's frame, unit, towards the viewer
};

CloudImage splat(const Cloud& cloud, const std::vector<float>& values, const CloudView& view, cv::Size size);

}  // namespace crumple
