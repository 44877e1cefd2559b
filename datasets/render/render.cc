#include "datasets/render/render.h"

#include <cassert>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "datasets/render/sensor.h"
#include "datasets/render/transport.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::uint64_t noise_seed(std::uint64_t seed, std::size_t station, std::size_t camera, std::size_t frame) {
  return mix(mix(mix(seed, station), camera), frame);
}

struct Renderer::Prepared {
  std::vector<PreparedCamera> cameras;
  std::optional<PreparedProjector> projector;
  std::optional<Tracer> board;
  std::optional<Tracer> panel;

  explicit Prepared(const Scene& scene) {
    cameras.reserve(scene.cameras.size());
    for (const SceneCamera& camera : scene.cameras) cameras.emplace_back(camera);
    if (scene.projector) projector.emplace(*scene.projector);
    if (scene.board) board.emplace(*scene.board);
    if (scene.panel) panel.emplace(*scene.panel);
  }

  const Tracer& tracer(const SceneStation& station) const {
    const std::optional<Tracer>& tracer = station.board ? board : panel;
    assert(tracer);
    return *tracer;
  }

  Transport transport(const Scene& scene, std::size_t station, std::size_t camera, int threads) const {
    const SceneStation& placed = scene.stations[station];
    const TransportSettings settings{scene.lighting, scene.samples, mix(mix(scene.seed, station), camera), threads};
    return Transport::trace(cameras[camera], projector ? &*projector : nullptr, tracer(placed),
                            placed.probe_from_surface, settings);
  }
};

Renderer::Renderer(const Scene& scene, int threads)
    : scene_(scene), threads_(threads), prepared_(std::make_unique<const Prepared>(scene)) {}
Renderer::~Renderer() = default;

Expected<void> Renderer::render_station(std::size_t station, const FrameSink& sink) const {
  Expected<void> outcome;
  std::mutex outcome_mutex;
  for (std::size_t camera = 0; camera < scene_.cameras.size(); ++camera) {
    const Transport transport = prepared_->transport(scene_, station, camera, threads_);
    parallel_for(scene_.frames.size(), threads_, [&](std::size_t frame) {
      {
        const std::lock_guard lock(outcome_mutex);
        if (!outcome) return;
      }
      const cv::Mat shown = projector_image(scene_, scene_.frames[frame]);
      const cv::Mat1f light =
          transport.radiance(shown.empty() ? cv::Mat1f() : emission(scene_.projector->emitter, shown));
      const Expected<void> taken =
          sink({camera, frame,
                expose(scene_.cameras[camera].detector, light, noise_seed(scene_.seed, station, camera, frame))});
      if (!taken) {
        const std::lock_guard lock(outcome_mutex);
        outcome = taken;
      }
    });
    if (!outcome) break;
  }
  return outcome;
}

std::vector<cv::Mat1f> Renderer::radiances(std::size_t station, std::size_t camera) const {
  const Transport transport = prepared_->transport(scene_, station, camera, threads_);
  std::vector<cv::Mat1f> light(scene_.frames.size());
  parallel_for(light.size(), threads_, [&](std::size_t frame) {
    const cv::Mat shown = projector_image(scene_, scene_.frames[frame]);
    light[frame] = transport.radiance(shown.empty() ? cv::Mat1f() : emission(scene_.projector->emitter, shown));
  });
  return light;
}

cv::Mat1f Renderer::radiance(std::size_t station, std::size_t camera, const FrameContent& frame) const {
  const cv::Mat shown = projector_image(scene_, frame);
  const Transport transport = prepared_->transport(scene_, station, camera, threads_);
  return transport.radiance(shown.empty() ? cv::Mat1f() : emission(scene_.projector->emitter, shown));
}

TrueGeometry Renderer::true_geometry(std::size_t station, std::size_t camera) const {
  const SceneStation& placed = scene_.stations[station];
  const Tracer& tracer = prepared_->tracer(placed);
  const Sensor& sensor = scene_.cameras[camera].sensor;
  const Pose camera_from_surface = sensor.sensor_from_mount * placed.probe_from_surface;
  const Pose surface_from_camera = camera_from_surface.inverse();
  const ImageSize size = sensor.lens.size();
  TrueGeometry truth{cv::Mat1d(size.height_px, size.width_px, none),
                     cv::Mat2d(size.height_px, size.width_px, cv::Vec2d(none, none))};
  parallel_for(static_cast<std::size_t>(size.height_px), threads_, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size.width_px; ++x) {
      const auto ray = prepared_->cameras[camera].rays.at(x, y);
      if (!ray) continue;
      const auto hit = tracer.first_hit(surface_from_camera.translation, surface_from_camera.rotation * *ray);
      if (!hit) continue;
      truth.depth_mm(y, x) = (camera_from_surface * *hit).z();
      if (!scene_.projector) continue;
      const Pose projector_from_surface = scene_.projector->sensor.sensor_from_mount * placed.probe_from_surface;
      const SurfacePoint point = tracer.surface().at(hit->x(), hit->y());
      const auto pixel =
          prepared_->projector->pixel_towards(projector_from_surface * *hit, Eigen::Vector3d::Zero(), 0.5);
      const Eigen::Vector3d light = projector_from_surface.inverse().translation;
      const bool faces_light = point.normal.dot(light - point.position_mm) > 0;
      if (pixel && faces_light && !tracer.shadowed(point, light)) truth.projector_px(y, x) = {pixel->x(), pixel->y()};
    }
  });
  return truth;
}

}  // namespace crumple
