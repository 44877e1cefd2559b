// Light transport from a projector to a camera, by sampling: traced once per placement, then every pattern is a sum.
//
// A camera pixel's light is linear in what the projector's pixels emit. Each pixel is sampled over its footprint (the
// square pixel, the lens' blur) and over both apertures; each sample finds its place on the projector's panel and
// spreads its reflectance over the blurred square pixels there. What results is one row of the transport matrix per
// camera pixel: small windows of weights on the panel. Direct light is followed and, where the lighting says so, light
// that was scattered once before, by one more ray a sample.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "datasets/render/light.h"
#include "datasets/render/sampling.h"
#include "datasets/render/scene.h"
#include "datasets/render/tracer.h"

namespace crumple {

// Ray directions (x, y, 1) between pixel centres, from a table that reaches past the image's edge by the footprint.
class RayField {
 public:
  RayField(const Lens& lens, double margin_px);
  // Bilinear: off by an eighth of the distortion's second derivative, some 1e-5 px. No value where the lens has no ray.
  std::optional<Eigen::Vector3d> at(double x, double y) const;

 private:
  int margin_px_;
  int width_px_;
  std::vector<Eigen::Vector2d> rays_;
};

// What a camera contributes at every placement.
struct PreparedCamera {
  const SceneCamera& camera;
  Footprint footprint;
  RayField rays;

  explicit PreparedCamera(const SceneCamera& scene_camera);
};

// The same for the projector.
struct PreparedProjector {
  const SceneProjector& projector;
  PixelSpread spread;
  double widest_slope;  // of the rays its panel sends out: beyond, the lens model may fold back on itself

  explicit PreparedProjector(const SceneProjector& scene_projector);

  // The pixel whose light, leaving the lens at lens_point, goes to a point (both in the projector's frame, lens_point
  // in its plane z = 0). No value where none does within `margin_px` of the panel's outer pixel centres.
  std::optional<Eigen::Vector2d> pixel_towards(const Eigen::Vector3d& point, const Eigen::Vector3d& lens_point,
                                               double margin_px) const;
};

struct TransportSettings {
  Lighting lighting;
  int samples = 16;
  std::uint64_t seed = 1;
  int threads = 1;
  std::optional<Box> body = {};  // dark and dull, before the surface; its mount is the surface's frame
};

class Transport {
 public:
  // `projector` may be null: then there is ambient light only. `mount_from_surface`: of what carries both sensors.
  static Transport trace(const PreparedCamera& camera, const PreparedProjector* projector, const Tracer& tracer,
                         const Pose& mount_from_surface, const TransportSettings& settings);

  // Radiance per camera pixel for an emission image of the projector's size; empty: under ambient light alone.
  cv::Mat1f radiance(const cv::Mat1f& emission) const;

 private:
  friend class RowTracer;

  // Weights of a rectangle of projector pixels, row by row.
  struct Window {
    std::uint16_t left = 0;
    std::uint16_t top = 0;
    std::uint16_t width = 0;  // a multiple of four, for the sake of the inner loop
    std::uint16_t height = 0;
  };

  struct Row {
    std::vector<float> ambient;               // per camera pixel
    std::vector<std::uint8_t> window_counts;  // per camera pixel
    std::vector<Window> windows;
    std::vector<float> weights;
  };

  static void light_row(const Row& row, const cv::Mat1f& emission, float* radiance);

  ImageSize size_;
  std::vector<Row> rows_;
};

}  // namespace crumple
