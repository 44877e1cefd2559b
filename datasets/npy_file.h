// NumPy's .npy files (format version 1.0) with one matrix of doubles.
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

// float64, little-endian, C order; every bit survives.
Expected<void> write_npy(const std::filesystem::path& file, const Eigen::MatrixXd& matrix);

// Takes float64 matrices (two dimensions, either order). Fails, naming the file, on other types and shapes, on a file
// that is too short or too long, and on a number that is not finite.
Expected<Eigen::MatrixXd> read_npy(const std::filesystem::path& file);
// The same from memory; errors name no file.
Expected<Eigen::MatrixXd> parse_npy(const std::string& bytes);

// What stands before the numbers of an array in C order: `type` is NumPy's ("<f8"), `shape` a Python tuple ("(2, 3)").
std::string npy_preamble(const std::string& type, const std::string& shape);

}  // namespace crumple
