// The spots that LEDs, lamps and reflections make in the images of a tracker, a camera fixed to the world.
//
// A spot's light falls with the square of the distance and with cos^4 off the axis. It is spread by a Gaussian, whose
// integral over each pixel is what the pixel receives: the lens' blur, and as much more as the thin lens' disc of
// confusion has variance. What the probe's body or the surface in view hides makes no spot.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "datasets/render/scene.h"
#include "datasets/render/tracer.h"

namespace crumple {

struct LedSpot {
  Eigen::Vector2d centre_px;
  double sigma_px = 0;
  double light = 0;                // summed over the pixels, in full wells
  std::optional<std::size_t> led;  // seen directly; none of reflections and lamps
};

// What stands in the world at a station and may hide a light.
struct Obstacle {
  const Tracer* tracer = nullptr;
  Pose surface_from_world;
};

// The spots in one image of a tracker; `frame` is an index into the scene's tracking frames. Lamps are in every image.
std::vector<LedSpot> spots_seen(const Scene& scene, std::size_t station, std::size_t tracker, std::size_t frame,
                                const std::optional<Obstacle>& obstacle);

// Adds the spots' light, in full wells, divided by `full_wells_per_unit`.
void draw_spots(const std::vector<LedSpot>& spots, double full_wells_per_unit, cv::Mat1f& image);

// Whether chance left this image unwritten: never one of ambient light.
bool is_missing(const Scene& scene, std::size_t station, std::size_t tracker, std::size_t frame);

}  // namespace crumple
