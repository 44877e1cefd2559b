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
  std::uint16_t view = 0;     // which camera at which station measured it, counted as views were added
};

// What a view has in a point that was merged of several: its weight, of one in all.
struct CloudShare {
  std::uint32_t point = 0;  // index into Cloud::points
  std::uint16_t view = 0;
  float weight = 0;
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
  std::vector<CloudShare> shares = {};    // point by point; none where every point is of its own view alone
};

}  // namespace crumple
