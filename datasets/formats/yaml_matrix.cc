#include "datasets/formats/yaml_matrix.h"

#include <cmath>

#include <fmt/format.h>

#include "datasets/limits.h"

namespace crumple {
namespace {

constexpr int kMostTerms = 100;

}  // namespace

std::vector<double> read_row(const YamlValue& value, std::size_t count) {
  const std::vector<YamlValue> items = value.list();
  std::vector<double> numbers(count);
  if (items.size() != count) {
    value.problem(fmt::format("must be a list of {} numbers", count));
    return numbers;
  }
  for (std::size_t i = 0; i < count; ++i) numbers[i] = items[i].number(-kLargestValue, kLargestValue);
  return numbers;
}

Eigen::MatrixXd read_rows(const YamlValue& value, int rows, int columns) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(rows, columns);
  const std::vector<YamlValue> items = value.list();
  if (static_cast<int>(items.size()) != rows) {
    value.problem(fmt::format("must hold {} rows of {} numbers", rows, columns));
    return matrix;
  }
  for (int row = 0; row < rows; ++row) {
    const std::vector<double> numbers =
        read_row(items[static_cast<std::size_t>(row)], static_cast<std::size_t>(columns));
    matrix.row(row) = Eigen::Map<const Eigen::RowVectorXd>(numbers.data(), columns);
  }
  return matrix;
}

Eigen::MatrixXd read_ros_matrix(const YamlValue& value, int rows, int columns) {
  YamlMap map = value.map();
  const auto row_count = map.require("rows", "how many rows");
  const auto column_count = map.require("cols", "how many columns");
  const auto data = map.require("data", "the numbers, row by row");
  const int lowest = std::max(columns, 0);
  const int highest = columns < 0 ? kMostTerms : columns;
  const int found_rows = row_count ? row_count->integer(rows, rows) : rows;
  const int found_columns = column_count ? column_count->integer(lowest, highest) : lowest;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(found_rows, found_columns);
  if (!data) return matrix;
  const std::vector<double> numbers = read_row(*data, static_cast<std::size_t>(matrix.size()));
  for (int i = 0; i < static_cast<int>(numbers.size()); ++i) {
    matrix(i / found_columns, i % found_columns) = numbers[static_cast<std::size_t>(i)];
  }
  return matrix;
}

ImageSize whole_size(const YamlValue& value, const std::vector<double>& size) {
  for (const double pixels : size) {
    if (pixels >= 1 && pixels <= kLargestImage_px && pixels == std::floor(pixels)) continue;
    value.problem("must be whole numbers of pixels above zero");
    return {};
  }
  return {static_cast<int>(size[0]), static_cast<int>(size[1])};
}

}  // namespace crumple
