#include "calib/flatten_lighting.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/QR>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

constexpr int kTerms = 6;
constexpr double kDark = 60;
constexpr double kLight = 200;
constexpr double kLeastContrast = 0.01;  // of the brightest; keeps the quotient finite outside the board

using Terms = Eigen::Matrix<double, kTerms, 1>;

struct Sample {
  Eigen::Vector2d at;  // image coordinates scaled to about -1..1
  double intensity = 0;
};

Terms terms(const Eigen::Vector2d& p) {
  return (Terms() << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y()).finished();
}

Eigen::Vector2d scaled(const Eigen::Vector2d& pixel, const cv::Size& size) {
  return {2 * pixel.x() / size.width - 1, 2 * pixel.y() / size.height - 1};
}

Terms fit(const std::vector<Sample>& samples) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(samples.size()), kTerms);
  Eigen::VectorXd right(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) = terms(samples[static_cast<std::size_t>(i)].at).transpose();
    right[i] = samples[static_cast<std::size_t>(i)].intensity;
  }
  // Fewer squares than terms leave the smoothest solution.
  return rows.completeOrthogonalDecomposition().solve(right);
}

// The mean over a fifth of a square around its centre, of squares of either colour.
std::array<std::vector<Sample>, 2> sample_squares(const cv::Mat& image, const std::vector<Eigen::Vector2d>& corners,
                                                  int columns, int rows) {
  const auto corner = [&](int row, int column) { return corners[static_cast<std::size_t>(row * columns + column)]; };
  std::array<std::vector<Sample>, 2> samples;
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const Eigen::Vector2d centre = 0.25 * (corner(row, column) + corner(row, column + 1) + corner(row + 1, column) +
                                             corner(row + 1, column + 1));
      const int half = static_cast<int>((corner(row, column) - centre).norm() / 7);
      const cv::Rect around(static_cast<int>(std::lround(centre.x())) - half,
                            static_cast<int>(std::lround(centre.y())) - half, 2 * half + 1, 2 * half + 1);
      const cv::Rect visible = around & cv::Rect({0, 0}, image.size());
      if (visible.empty()) continue;
      samples[static_cast<std::size_t>((row + column) % 2)].push_back(
          {scaled(centre, image.size()), cv::mean(image(visible))[0]});
    }
  }
  return samples;
}

}  // namespace

cv::Mat flatten_lighting(const cv::Mat& image, const std::vector<Eigen::Vector2d>& corners, int columns, int rows) {
  const auto samples = sample_squares(image, corners, columns, rows);
  Terms dark = fit(samples[0]), light = fit(samples[1]);
  if (dark[0] > light[0]) std::swap(dark, light);
  double brightest = 0;
  cv::minMaxLoc(image, nullptr, &brightest);
  cv::Mat values, flat(image.size(), CV_8U);
  image.convertTo(values, CV_64F);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const Terms t = terms(scaled({x, y}, image.size()));
      const double contrast = std::max((light - dark).dot(t), kLeastContrast * brightest);
      const double share = (values.at<double>(y, x) - dark.dot(t)) / contrast;
      flat.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(kDark + (kLight - kDark) * share);
    }
  }
  return flat;
}

}  // namespace crumple
