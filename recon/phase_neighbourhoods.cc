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
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double centre = u.at<double>(y, x);
  for (int j = std::max(0, y - kReach); j <= std::min(u.rows - 1, y + kReach); ++j) {
    for (int i = std::max(0, x - kReach); i <= std::min(u.cols - 1, x + kReach); ++i) {
      if (sigma.at<float>(j, i) <= 0) continue;
      const double rise = u.at<double>(j, i) - centre;
      if (std::abs(rise) > 4 * kReach) continue;
      const Eigen::Vector3d a(i - x, j - y, 1);
      normal += a * a.transpose();
      right += a * rise;
    }
  }
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
