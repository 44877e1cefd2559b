#include "tests/calib/drawn_target.h"

#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "calib/target_print.h"

namespace crumple {
namespace {

constexpr int kStep_px = 2;  // between the places where the board is met exactly
constexpr int kSamples = 8;  // along each side of a pixel
constexpr float kWhite = 210, kBlack = 25;

// On the board's plane, of the pixel grid's nodes.
cv::Mat2d met_board(const Lens& lens, const Pose& camera_from_board) {
  const ImageSize size = lens.size();
  const Pose board_from_camera = camera_from_board.inverse();
  cv::Mat2d met(size.height_px / kStep_px + 2, size.width_px / kStep_px + 2);
  for (int y = 0; y < met.rows; ++y) {
    for (int x = 0; x < met.cols; ++x) {
      const auto ray = lens.ray({kStep_px * x - 1.0, kStep_px * y - 1.0});
      const Eigen::Vector3d direction = board_from_camera.rotation * ray.value();
      const Eigen::Vector3d& origin = board_from_camera.translation;
      const Eigen::Vector3d at = origin - origin.z() / direction.z() * direction;
      met(y, x) = {at.x(), at.y()};
    }
  }
  return met;
}

Eigen::Vector2d interpolated(const cv::Mat2d& met, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d at = (pixel + Eigen::Vector2d::Ones()) / kStep_px;
  const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
  const double u = at.x() - x, v = at.y() - y;
  const cv::Vec2d value =
      (1 - v) * ((1 - u) * met(y, x) + u * met(y, x + 1)) + v * ((1 - u) * met(y + 1, x) + u * met(y + 1, x + 1));
  return {value[0], value[1]};
}

}  // namespace

cv::Mat1f blank(ImageSize size) { return cv::Mat1f(size.height_px, size.width_px, kWhite); }

void draw_target(const Target& target, const Lens& lens, const Pose& camera_from_board, cv::Mat1f& scene) {
  const TargetPrint print(target);
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(target.pitch_mm / 3);
  const Eigen::Array2d low = print.extent().low_mm - margin, high = print.extent().high_mm + margin;
  const cv::Mat2d met = met_board(lens, camera_from_board);
  for (int y = 0; y < scene.rows; ++y) {
    for (int x = 0; x < scene.cols; ++x) {
      const Eigen::Array2d middle = interpolated(met, Eigen::Vector2d(x, y));
      if ((middle < low).any() || (middle > high).any()) continue;
      int dark = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        // Rows are shifted against each other, so that an edge along the columns does not meet eight samples at once.
        const double row = (i / kSamples + 0.5) / kSamples, column = (i % kSamples + row) / kSamples;
        dark += print.dark(interpolated(met, Eigen::Vector2d(x + column - 0.5, y + row - 0.5))) ? 1 : 0;
      }
      scene(y, x) = kWhite + (kBlack - kWhite) * static_cast<float>(dark) / (kSamples * kSamples);
    }
  }
}

cv::Mat photographed(const cv::Mat1f& scene, const DrawOptions& options) {
  cv::Mat1f blurred;
  cv::GaussianBlur(scene, blurred, {0, 0}, options.blur_px);
  std::mt19937_64 generator(options.seed);
  std::normal_distribution<double> normal;
  cv::Mat image(scene.size(), CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(blurred(y, x) + options.noise * normal(generator));
    }
  }
  return image;
}

Lens drawing_lens() {
  return Lens::create("LENSMODEL_OPENCV5", {960, 720}, {1000, 1004, 476, 362, -0.12, 0.05, 3e-4, -4e-4, 0}).value();
}

Pose drawing_pose(const Target& target, double distance_mm, const Eigen::Vector3d& rotation_rad) {
  const auto [low, high] = TargetPrint(target).extent();
  const Eigen::Vector2d middle = 0.5 * (low + high);
  Pose pose;
  pose.rotation = rotation_from_vector(rotation_rad);
  pose.translation = Eigen::Vector3d(0, 0, distance_mm) - pose.rotation * Eigen::Vector3d(middle.x(), middle.y(), 0);
  return pose;
}

Eigen::Vector2d true_pixel(const Board& board, int index, const Lens& lens, const Pose& camera_from_board) {
  if (!board.has_discs()) return lens.project(camera_from_board * board.point(index)).value();
  constexpr int kRings = 24, kSpokes = 32;  // of equal areas
  const Eigen::Matrix<double, 3, 2> in_plane = camera_from_board.rotation.toRotationMatrix().leftCols<2>();
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  double area = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double radius = board.disc_radius_mm() * std::sqrt((ring + 0.5) / kRings);
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      const double angle = 2 * std::numbers::pi * spoke / kSpokes;
      const Eigen::Vector2d nominal = board.nominal_mm()[static_cast<std::size_t>(index)] +
                                      radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const Projection projection = lens.project_with_gradients(camera_from_board * board.on_surface(nominal)).value();
      const double weight = (projection.d_point * in_plane).determinant();
      moment += weight * projection.pixel;
      area += weight;
    }
  }
  return moment / area;
}

}  // namespace crumple
