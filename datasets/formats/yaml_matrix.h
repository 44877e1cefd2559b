// Rows and matrices of numbers in the YAML of other programs.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "datasets/yaml_reader.h"
#include "solvers/lens.h"

namespace crumple {

// Exactly `count` numbers; zeros beside a problem.
std::vector<double> read_row(const YamlValue& value, std::size_t count);

// A list of rows; zeros beside a problem.
Eigen::MatrixXd read_rows(const YamlValue& value, int rows, int columns);

// {rows: R, cols: C, data: [...]} as ROS writes it, with the rows and columns asked for. Any number of columns where
// `columns` is below 0. Zeros beside a problem.
Eigen::MatrixXd read_ros_matrix(const YamlValue& value, int rows, int columns);

// Width and height; a problem of `value` where they are not whole and positive.
ImageSize whole_size(const YamlValue& value, const std::vector<double>& width_and_height);

}  // namespace crumple
