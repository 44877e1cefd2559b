// Points measured on a surface, each with what is known about its error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace crumple {

struct CloudPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, towards the camera; zero where it could not be told
  float intensity = 0;                               // of the white frame, 0..1 of the sensor's range
  float sigma_mm = 0;                                // standard uncertainty along the camera ray, from decoding alone
  Eigen::Matrix3f covariance_mm2 = Eigen::Matrix3f::Zero();
  std::uint16_t station = 0;  // index into Cloud::stations
  float quality = 0;          // 0..1: 1 where every orientation agrees within its sigma
};

// A further number of every point, such as what a thermal camera shows there.
struct CloudColumn {
  std::string name;
  std::vector<float> values;
};

struct Cloud {
  std::string frame = "probe";  // the frame the positions are in
  std::vector<std::string> stations;
  std::vector<CloudPoint> points;
  std::vector<CloudColumn> columns = {};  // of what is read from files the usual ones only
};

}  // namespace crumple
