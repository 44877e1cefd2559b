#include "calib/refine_corner.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/LU>

#include "calib/grey_image.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kReachOfStep = 0.45;
constexpr double kReach_px = 12;
constexpr double kStartBlur_px = 0.7;
constexpr double kLeastBlur_px = 0.2;
constexpr double kMostBlurOfStep = 0.25;
constexpr double kFarthest_px = 2.5;      // from the start
constexpr double kLeastExplained = 0.75;  // of the intensities' variance
constexpr double kSettled_px = 1e-5;
constexpr int kCornerIterations = 30;
constexpr int kNonlinear = 5;  // corner x y, directions of the edges, blur
constexpr int kLinear = 6;     // brightness and contrast, each 1, dx, dy
constexpr int kUnknowns = kNonlinear + kLinear;

using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Sample {
  Eigen::Vector2d from_start;
  double intensity;
};

struct CornerParameters {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // from the start
  Eigen::Vector2d angle_rad;                         // of the edges along the rows and along the columns
  double blur_px = kStartBlur_px;
  Eigen::Matrix<double, kLinear, 1> linear = Eigen::Matrix<double, kLinear, 1>::Zero();
};

// The pixels of the parallelogram around the start that is free of other edges. None where it leaves the image.
std::vector<Sample> samples_around(const cv::Mat& image, const Eigen::Vector2d& start, const Eigen::Vector2d& step_x,
                                   const Eigen::Vector2d& step_y) {
  Eigen::Matrix2d steps;
  steps << step_x, step_y;
  if (std::abs(steps.determinant()) < 1) return {};
  const Eigen::Matrix2d in_steps = steps.inverse();
  std::vector<Sample> samples;
  const int reach = static_cast<int>(kReach_px);
  const int column = static_cast<int>(std::lround(start.x())), row = static_cast<int>(std::lround(start.y()));
  for (int y = row - reach; y <= row + reach; ++y) {
    for (int x = column - reach; x <= column + reach; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - start;
      if (offset.norm() > kReach_px || (in_steps * offset).cwiseAbs().maxCoeff() > kReachOfStep) continue;
      if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) return {};
      samples.push_back({offset, intensity_at(image, x, y)});
    }
  }
  return samples;
}

struct Modelled {
  double intensity;
  Vector gradient;
};

Modelled model_at(const CornerParameters& p, const Eigen::Vector2d& from_start) {
  const Eigen::Vector2d d = from_start - p.corner;
  Eigen::Vector2d edge, slope, z;  // erf(...), its derivative by z, and z, of both edges
  Eigen::Matrix2d normal, along;   // columns
  for (int i = 0; i < 2; ++i) {
    along.col(i) << std::cos(p.angle_rad[i]), std::sin(p.angle_rad[i]);
    normal.col(i) << -along(1, i), along(0, i);
    z[i] = normal.col(i).dot(d);
    const double t = z[i] / (std::numbers::sqrt2 * p.blur_px);
    edge[i] = std::erf(t);
    slope[i] = std::sqrt(2 / std::numbers::pi) / p.blur_px * std::exp(-t * t);
  }
  const double s = edge[0] * edge[1];
  const Eigen::Vector2d d_z(slope[0] * edge[1], edge[0] * slope[1]);  // of s
  const Eigen::Vector3d plane(1, d.x(), d.y());
  const double contrast = p.linear.tail<3>().dot(plane);
  Modelled m;
  m.intensity = p.linear.head<3>().dot(plane) + contrast * s;
  m.gradient.head<2>() = -contrast * (normal * d_z) - p.linear.segment<2>(1) - s * p.linear.segment<2>(4);
  for (int i = 0; i < 2; ++i) m.gradient[2 + i] = -contrast * d_z[i] * along.col(i).dot(d);
  m.gradient[4] = -contrast * d_z.dot(z) / p.blur_px;
  m.gradient.segment<3>(5) = plane;
  m.gradient.tail<3>() = s * plane;
  return m;
}

struct CornerEquations {
  Matrix matrix = Matrix::Zero();
  Vector right = Vector::Zero();
  double squares = 0;
};

CornerEquations linearise(const CornerParameters& p, const std::vector<Sample>& samples) {
  CornerEquations n;
  for (const Sample& sample : samples) {
    const Modelled m = model_at(p, sample.from_start);
    const double residual = sample.intensity - m.intensity;
    n.matrix.noalias() += m.gradient * m.gradient.transpose();
    n.right += residual * m.gradient;
    n.squares += residual * residual;
  }
  return n;
}

CornerParameters moved(const CornerParameters& p, const Vector& step) {
  CornerParameters next = p;
  next.corner += step.head<2>();
  next.angle_rad += step.segment<2>(2);
  next.blur_px = std::max(kLeastBlur_px, p.blur_px + std::clamp(step[4], -0.5 * p.blur_px, p.blur_px));
  next.linear += step.tail<kLinear>();
  return next;
}

// Brightness and contrast for the start's geometry.
void solve_linear(const std::vector<Sample>& samples, CornerParameters& p) {
  const CornerEquations n = linearise(p, samples);
  const Eigen::Matrix<double, kLinear, kLinear> matrix = n.matrix.bottomRightCorner<kLinear, kLinear>();
  p.linear += solve_symmetric(matrix, n.right.tail<kLinear>());
}

double variance_of(const std::vector<Sample>& samples) {
  double sum = 0, squares = 0;
  for (const Sample& sample : samples) {
    sum += sample.intensity;
    squares += sample.intensity * sample.intensity;
  }
  return squares - sum * sum / static_cast<double>(samples.size());
}

}  // namespace

std::optional<RefinedCorner> refine_corner(const cv::Mat& image, const Eigen::Vector2d& start,
                                           const Eigen::Vector2d& step_x, const Eigen::Vector2d& step_y) {
  const std::vector<Sample> samples = samples_around(image, start, step_x, step_y);
  if (samples.size() < 3 * kUnknowns) return std::nullopt;
  CornerParameters p;
  p.angle_rad << std::atan2(step_x.y(), step_x.x()), std::atan2(step_y.y(), step_y.x());
  solve_linear(samples, p);

  CornerEquations at = linearise(p, samples);
  double damping = 1e-3;
  bool settled = false;
  for (int i = 0; i < kCornerIterations && !settled; ++i) {
    Matrix damped = at.matrix;
    damped.diagonal() *= 1 + damping;
    const Vector step = solve_symmetric(damped, at.right);
    if (!step.allFinite()) return std::nullopt;
    const CornerParameters next = moved(p, step);
    const CornerEquations there = linearise(next, samples);
    settled = step.head<2>().norm() < kSettled_px;
    if (there.squares > at.squares) {
      damping *= 10;
      continue;
    }
    p = next;
    at = there;
    damping *= 0.1;
  }
  const double most_blur_px = kMostBlurOfStep * std::min(step_x.norm(), step_y.norm());
  if (!settled || p.corner.norm() > kFarthest_px || p.blur_px > most_blur_px) return std::nullopt;
  if (at.squares >= (1 - kLeastExplained) * variance_of(samples)) return std::nullopt;
  const double variance = at.squares / static_cast<double>(samples.size() - kUnknowns);
  const Matrix inverse = solve_symmetric(at.matrix, Matrix::Identity());
  return RefinedCorner{start + p.corner, std::sqrt(0.5 * variance * inverse.topLeftCorner<2, 2>().trace()), p.blur_px};
}

}  // namespace crumple
