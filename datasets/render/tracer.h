// Rays against one surface: Embree finds the triangle, Newton's method the exact point.
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include "datasets/render/surfaces.h"

namespace crumple {

// Keeps a reference to the surface. Safe to call from several threads.
class Tracer {
 public:
  explicit Tracer(const Surface& surface);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;
  Tracer& operator=(Tracer&&) = delete;

  const Surface& surface() const { return surface_; }

  // The first point of the surface met by origin + t * direction, t > 0, in the surface frame.
  std::optional<Eigen::Vector3d> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  // Whether the surface itself stands between one of its points and a light.
  bool shadowed(const SurfacePoint& point, const Eigen::Vector3d& light) const;

 private:
  struct Embree;
  const Surface& surface_;
  std::unique_ptr<const Embree> embree_;
};

}  // namespace crumple
