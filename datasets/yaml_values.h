// Values that captures, scenes and rigs share: numbers with a default, vectors, sizes, stripe orientations.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "datasets/capture.h"
#include "datasets/yaml_reader.h"
#include "recon/patterns.h"
#include "solvers/lens.h"

namespace crumple {

double number_or(YamlMap& map, const std::string& key, double otherwise, double lowest, double highest);
double required_number(YamlMap& map, const std::string& key, const std::string& what, double lowest, double highest);

// A list of exactly N numbers between the bounds; zeros beside a problem.
template <int N>
Eigen::Matrix<double, N, 1> read_vector(const YamlValue& value, double lowest, double highest);

// 1 to 100 letters, digits, _ and -: what names that end up in file names and reports are made of.
bool is_plain_name(const std::string& name);

// Whether a station's id can be part of file names: any text without slashes and control characters, not . or ..
bool is_station_name(const std::string& name);

// size_px: [width, height]; 0 x 0 beside a problem.
ImageSize read_size_px(YamlMap& map);

// inner_corners: [columns, rows], and the same under another key.
std::pair<int, int> read_inner_corners(YamlMap& map);
std::pair<int, int> read_columns_and_rows(YamlMap& map, const std::string& key, int lowest);

// Keys of docs/formats.md. With the projector's panel, what does not fit on it is a problem too.
StripeOrientation read_orientation(const YamlValue& value, const std::optional<ImageSize>& panel);
ProjectedChessboard read_projected_chessboard(const YamlValue& value, const std::optional<ImageSize>& panel);

}  // namespace crumple
