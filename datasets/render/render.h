// Renders a scene's stations: every frame of every camera, and the truth beside them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "datasets/render/scene.h"
#include "solvers/expected.h"

namespace crumple {

// Per camera pixel, seen from the pixel's centre through the lens' centre: depth along the camera's z axis in mm and
// the projector pixel that lights the point; NaN where there is none (nothing met; in shadow or off the panel).
struct TrueGeometry {
  cv::Mat1d depth_mm;
  cv::Mat2d projector_px;
};

// One image of one station. `camera` and `frame` are indices into the scene's.
struct RenderedFrame {
  std::size_t camera = 0;
  std::size_t frame = 0;
  cv::Mat image;
};

// The seed of one image's detector noise; `seed` is the scene's own in render_station.
std::uint64_t noise_seed(std::uint64_t seed, std::size_t station, std::size_t camera, std::size_t frame);

// The seed of an image of a tracker, in streams of their own.
std::uint64_t tracker_noise_seed(std::uint64_t seed, std::size_t station, std::size_t tracker, std::size_t frame);

// Called from several threads at once, each frame once, in no particular order. An error ends the rendering.
using FrameSink = std::function<Expected<void>(const RenderedFrame&)>;

// Prepares what all stations share (rays, meshes). Keeps a reference to the scene.
class Renderer {
 public:
  Renderer(const Scene& scene, int threads);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Same bits at any number of threads.
  Expected<void> render_station(std::size_t station, const FrameSink& sink) const;

  // The trackers' images at a station; `camera` and `frame` of what the sink takes are indices into the scene's
  // tracking. Images that chance leaves out (led_spots.h) do not reach it.
  Expected<void> render_trackers(std::size_t station, const FrameSink& sink) const;

  // The light of one of these images before the detector, noise-free.
  cv::Mat1f tracker_radiance(std::size_t station, std::size_t tracker, std::size_t frame) const;

  // The light of every frame before the detector, noise-free: for many noise realisations of what is traced once.
  std::vector<cv::Mat1f> radiances(std::size_t station, std::size_t camera) const;

  // The light of one frame before the detector, noise-free.
  cv::Mat1f radiance(std::size_t station, std::size_t camera, const FrameContent& frame) const;

  TrueGeometry true_geometry(std::size_t station, std::size_t camera) const;

 private:
  struct Prepared;
  const Scene& scene_;
  int threads_;
  std::unique_ptr<const Prepared> prepared_;
};

}  // namespace crumple
