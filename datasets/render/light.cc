#include "datasets/render/light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

constexpr double gaussian_reach = 4.5;  // sigmas; beyond, the cumulative distribution is 0 or 1 to 4e-6
constexpr int table_steps_per_sigma = 512;

double fresnel(double normal_reflectance, double cosine) {
  const double grazing = 1 - std::clamp(cosine, 0.0, 1.0);
  const double squared = grazing * grazing;
  return normal_reflectance + (1 - normal_reflectance) * squared * squared * grazing;
}

// Smith's masking of one direction.
double unmasked(double cosine, double alpha_squared) {
  return 2 * cosine / (cosine + std::sqrt(alpha_squared + (1 - alpha_squared) * cosine * cosine));
}

// The normal distribution's cumulative function from a table: erf itself would take most of the rendering time.
double normal_cdf(double x) {
  constexpr int half_steps = static_cast<int>(gaussian_reach * table_steps_per_sigma);
  static const auto table = [] {
    std::array<double, 2 * half_steps + 2> values{};
    for (int i = 0; i <= 2 * half_steps + 1; ++i) {
      const double t = static_cast<double>(i - half_steps) / table_steps_per_sigma;
      values[static_cast<std::size_t>(i)] = 0.5 * std::erfc(-t / std::numbers::sqrt2);
    }
    return values;
  }();
  if (x <= -gaussian_reach) return 0;
  if (x >= gaussian_reach) return 1;
  const double position = (x + gaussian_reach) * table_steps_per_sigma;
  const auto cell = static_cast<std::size_t>(position);
  const double share = position - static_cast<double>(cell);
  return table[cell] + share * (table[cell + 1] - table[cell]);
}

}  // namespace

double reflectance(const Material& material, const Eigen::Vector3d& normal, const Eigen::Vector3d& to_light,
                   const Eigen::Vector3d& to_viewer) {
  const double cosine_light = normal.dot(to_light);
  const double cosine_viewer = normal.dot(to_viewer);
  if (cosine_light <= 0 || cosine_viewer <= 0) return 0;
  if (material.gloss <= 0) return material.albedo;
  const Eigen::Vector3d half = (to_light + to_viewer).normalized();
  const double alpha_squared = material.roughness * material.roughness;
  const double cosine_half = normal.dot(half);
  const double spread = cosine_half * cosine_half * (alpha_squared - 1) + 1;
  const double pi_density = alpha_squared / (spread * spread);
  return material.albedo + pi_density * fresnel(material.gloss, half.dot(to_viewer)) *
                               unmasked(cosine_light, alpha_squared) * unmasked(cosine_viewer, alpha_squared) /
                               (4 * cosine_light * cosine_viewer);
}

double ambient_reflectance(const Material& material, const Eigen::Vector3d& normal, const Eigen::Vector3d& to_viewer) {
  const double cosine = normal.dot(to_viewer);
  if (cosine <= 0) return 0;
  return material.albedo + (material.gloss > 0 ? fresnel(material.gloss, cosine) : 0);
}

double projector_irradiance(const Eigen::Vector3d& point_in_projector, double cosine_at_surface,
                            double reference_distance_mm) {
  const double z = point_in_projector.z();
  const double cosine_off_axis = z / point_in_projector.norm();
  const double nearness = reference_distance_mm / z;
  return nearness * nearness * cosine_at_surface / cosine_off_axis;
}

PixelSpread::PixelSpread(double pixel_fill, double blur_px)
    : half_fill_px_(pixel_fill / 2),
      inverse_blur_(1 / std::max(blur_px, 1e-9)),
      reach_px_(pixel_fill / 2 + gaussian_reach * blur_px) {}

double PixelSpread::weight(double offset_px) const {
  return (normal_cdf((offset_px + half_fill_px_) * inverse_blur_) -
          normal_cdf((offset_px - half_fill_px_) * inverse_blur_)) /
         (2 * half_fill_px_);
}

cv::Mat1f emission(const Emitter& emitter, const cv::Mat& image) {
  cv::Mat1f levels(1, 256);
  for (int code = 0; code < 256; ++code) {
    levels(0, code) = static_cast<float>(emitter.black + (1 - emitter.black) * std::pow(code / 255.0, emitter.gamma));
  }
  cv::Mat1f emitted;
  cv::LUT(image, levels, emitted);
  return emitted;
}

}  // namespace crumple
