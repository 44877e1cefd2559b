#include "tests/recon/synthetic_stripes.h"

#include <random>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

constexpr int kOversampling = 4;  // camera subpixels along one side
constexpr int kProjectorSamples = 8;

// The projected image at 8 samples per pixel, blurred by two boxes.
cv::Mat projected(const cv::Mat& pattern, double blur_px) {
  cv::Mat fine;
  cv::resize(pattern, fine, {}, kProjectorSamples, kProjectorSamples, cv::INTER_NEAREST);
  fine.convertTo(fine, CV_32F, 1 / 255.0);
  const int width = std::max(1, 2 * static_cast<int>(blur_px * kProjectorSamples / 2) + 1);
  for (int i = 0; i < 2; ++i) cv::blur(fine, fine, {width, width}, {-1, -1}, cv::BORDER_CONSTANT);
  return fine;
}

// Where every camera subpixel's light comes from, in pixels of the projected image.
cv::Mat light_sources(const StripeScene& scene) {
  cv::Mat sources(scene.camera.height * kOversampling, scene.camera.width * kOversampling, CV_32FC2);
  for (int j = 0; j < sources.rows; ++j) {
    for (int i = 0; i < sources.cols; ++i) {
      const Eigen::Vector2d camera((i + 0.5) / kOversampling - 0.5, (j + 0.5) / kOversampling - 0.5);
      const Eigen::Vector2d p = (scene.projector_from_camera(camera).array() + 0.5) * kProjectorSamples - 0.5;
      sources.at<cv::Vec2f>(j, i) = {static_cast<float>(p.x()), static_cast<float>(p.y())};
    }
  }
  return sources;
}

cv::Mat seen(const StripeScene& scene, const cv::Mat& sources, const cv::Mat& pattern, std::mt19937& random) {
  const cv::Mat light = projected(pattern, scene.projector_blur_px);
  cv::Mat fine;
  cv::remap(light, fine, sources, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  if (!scene.reflectance.empty()) fine = fine.mul(scene.reflectance);
  const int width = 2 * static_cast<int>(scene.camera_blur_px * kOversampling / 2) + 1;
  cv::blur(fine, fine, {width, width});
  cv::Mat image;
  cv::resize(fine, image, scene.camera, 0, 0, cv::INTER_AREA);
  image = image * (scene.white - scene.black) + scene.black;
  std::normal_distribution<float> normal;
  if (scene.noise > 0) {
    for (float& v : cv::Mat_<float>(image)) v += static_cast<float>(scene.noise) * normal(random);
  }
  // 16 bits keep rounding out of the way where no noise is asked for.
  cv::Mat rounded;
  image.convertTo(rounded, CV_16U, scene.noise > 0 ? 1 : 256);
  if (scene.noise > 0) rounded.convertTo(rounded, CV_8U);
  return rounded;
}

}  // namespace

Eigen::Vector2d tilted_plane(const Eigen::Vector2d& c) {
  const double w = 1 + 2e-4 * c.x() - 1e-4 * c.y();
  return Eigen::Vector2d(20.3 + 0.47 * c.x() + 0.031 * c.y(), 15.7 - 0.043 * c.x() + 0.52 * c.y()) / w;
}

StripeImages render_stripes(const StripeScene& scene, const std::vector<StripeOrientation>& orientations) {
  std::mt19937 random(scene.seed);
  const cv::Mat sources = light_sources(scene);
  const cv::Size panel(scene.projector.width_px, scene.projector.height_px);
  StripeImages images{.projector = scene.projector, .stacks = {}, .white = {}, .black = {}};
  images.white = seen(scene, sources, cv::Mat(panel, CV_8U, cv::Scalar(255)), random);
  images.black = seen(scene, sources, cv::Mat(panel, CV_8U, cv::Scalar(0)), random);
  for (const StripeOrientation& o : orientations) {
    StripeStack stack{.orientation = o, .patterns = {}, .inverses = {}};
    for (int b = 0; b < o.bits; ++b) {
      stack.patterns.push_back(seen(scene, sources, draw_stripes(o, scene.projector, b, false), random));
      if (o.inverse) stack.inverses.push_back(seen(scene, sources, draw_stripes(o, scene.projector, b, true), random));
    }
    images.stacks.push_back(stack);
  }
  return images;
}

double true_coordinate(const StripeScene& scene, const StripeOrientation& orientation, int x, int y) {
  return orientation.normal().dot(scene.projector_from_camera({x, y}));
}

}  // namespace crumple
