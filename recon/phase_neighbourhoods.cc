#include "recon/phase_neighbourhoods.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

// The plane through the 7 x 7 neighbourhood, by least squares over the pixels that have a coordinate: its slopes, and
// its value less u at the middle. Nothing where they do not tell.
std::optional<Eigen::Vector3d> plane_at(const cv::Mat& u, const cv::Mat& sigma, int x, int y) {
  constexpr int kReach = 3;
  int count = 0, sum_i = 0, sum_j = 0, sum_ii = 0, sum_ij = 0, sum_jj = 0;
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double centre = u.at<double>(y, x);
  for (int row = std::max(0, y - kReach); row <= std::min(u.rows - 1, y + kReach); ++row) {
    const auto* const values = u.ptr<double>(row);
    const auto* const sigmas = sigma.ptr<float>(row);
    const int j = row - y;
    for (int column = std::max(0, x - kReach); column <= std::min(u.cols - 1, x + kReach); ++column) {
      const double rise = values[column] - centre;
      if (!(sigmas[column] > 0) || std::abs(rise) > 4 * kReach) continue;
      const int i = column - x;
      ++count;
      sum_i += i;
      sum_j += j;
      sum_ii += i * i;
      sum_ij += i * j;
      sum_jj += j * j;
      right += Eigen::Vector3d(i, j, 1) * rise;
    }
  }
  Eigen::Matrix3d normal;
  normal << sum_ii, sum_ij, sum_i, sum_ij, sum_jj, sum_j, sum_i, sum_j, count;
  if (normal(2, 2) < 10 || normal.determinant() < 1e-3 * normal(2, 2)) return std::nullopt;
  return Eigen::Vector3d(normal.inverse() * right);
}

}  // namespace

PhaseNeighbourhoods phase_neighbourhoods(const cv::Mat& u, const cv::Mat& sigma) {
  const cv::Size size(5, 5);
  const cv::Mat valid = sigma > 0;
  PhaseNeighbourhoods result;
  cv::Mat complete, share, variance;
  cv::erode(valid, complete, cv::Mat::ones(size, CV_8U), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::blur(valid, share, size, {-1, -1}, cv::BORDER_CONSTANT);
  cv::blur(u, result.u, size, {-1, -1}, cv::BORDER_CONSTANT);
  cv::blur(sigma.mul(sigma), variance, size, {-1, -1}, cv::BORDER_CONSTANT);
  cv::divide(variance, share, variance, 255, CV_32F);
  cv::sqrt(variance, result.sigma);
  result.sigma.setTo(0, ~valid);
  result.slopes = cv::Mat(u.size(), CV_32FC2, cv::Scalar::all(0));
  cv::parallel_for_({0, u.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < u.cols; ++x) {
        if (valid.at<std::uint8_t>(y, x) == 0) continue;
        const auto plane = plane_at(u, sigma, x, y);
        if (plane) {
          result.slopes.at<cv::Vec2f>(y, x) = {static_cast<float>(plane->x()), static_cast<float>(plane->y())};
        }
        if (complete.at<std::uint8_t>(y, x) != 0) continue;
        result.u.at<double>(y, x) = u.at<double>(y, x) + (plane ? plane->z() : 0);
        if (!plane) result.sigma.at<float>(y, x) = 0;
      }
    }
  });
  return result;
}

}  // namespace crumple
