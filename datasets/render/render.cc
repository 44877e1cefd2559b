#include "datasets/render/render.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "datasets/render/led_spots.h"
#include "datasets/render/sensor.h"
#include "datasets/render/transport.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

// Even light needs few samples, and the edges in it get more by themselves.
constexpr int tracker_samples = 4;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

// The first error that any thread meets.
class FirstError {
 public:
  bool is_set() const {
    const std::lock_guard lock(mutex_);
    return !outcome_;
  }
  void keep(const Expected<void>& outcome) {
    const std::lock_guard lock(mutex_);
    if (outcome_) outcome_ = outcome;
  }
  const Expected<void>& get() const { return outcome_; }

 private:
  mutable std::mutex mutex_;
  Expected<void> outcome_;
};

// The background, where nothing stands in view.
cv::Mat1f empty_room(const PreparedCamera& camera, const Lighting& lighting) {
  const ImageSize size = camera.camera.sensor.lens.size();
  cv::Mat1f image(size.height_px, size.width_px, 0.0F);
  for (int y = 0; y < size.height_px; ++y) {
    for (int x = 0; x < size.width_px; ++x) {
      const auto ray = camera.rays.at(x, y);
      if (!ray) continue;
      const double vignetting = 1 / (ray->squaredNorm() * ray->squaredNorm());
      image(y, x) = static_cast<float>(vignetting * lighting.ambient * lighting.background);
    }
  }
  return image;
}

}  // namespace

std::uint64_t noise_seed(std::uint64_t seed, std::size_t station, std::size_t camera, std::size_t frame) {
  return mix(mix(mix(seed, station), camera), frame);
}

std::uint64_t tracker_noise_seed(std::uint64_t seed, std::size_t station, std::size_t tracker, std::size_t frame) {
  constexpr std::uint64_t stream = 0x747261636b6572;
  return noise_seed(mix(seed, stream), station, tracker, frame);
}

struct Renderer::Prepared {
  std::vector<PreparedCamera> cameras;
  std::vector<PreparedCamera> trackers;
  std::optional<PreparedProjector> projector;
  std::optional<Tracer> board;
  std::optional<Tracer> panel;
  std::vector<std::optional<Tracer>> objects;  // those that a station shows

  explicit Prepared(const Scene& scene) {
    cameras.reserve(scene.cameras.size());
    for (const SceneCamera& camera : scene.cameras) cameras.emplace_back(camera);
    trackers.reserve(scene.tracking.trackers.size());
    for (const SceneCamera& tracker : scene.tracking.trackers) trackers.emplace_back(tracker);
    if (scene.projector) projector.emplace(*scene.projector);
    if (scene.board) board.emplace(*scene.board);
    if (scene.panel) panel.emplace(*scene.panel);
    objects.resize(scene.objects.size());
    for (const SceneStation& station : scene.stations) {
      if (station.object && !objects[*station.object]) {
        objects[*station.object].emplace(*scene.objects[*station.object].surface);
      }
    }
  }

  const Tracer& tracer(const SceneStation& station) const {
    const std::optional<Tracer>& tracer = station.object ? objects[*station.object] : station.board ? board : panel;
    assert(tracer);
    return *tracer;
  }

  Transport transport(const Scene& scene, std::size_t station, std::size_t camera, int threads) const {
    const SceneStation& placed = scene.stations[station];
    const TransportSettings settings{scene.lighting, scene.samples, mix(mix(scene.seed, station), camera), threads};
    const bool lit = projector && !scene.cameras[camera].thermal;
    return Transport::trace(cameras[camera], lit ? &*projector : nullptr, tracer(placed), placed.probe_from_surface,
                            settings);
  }

  // What a tracker sees by the room's light alone, exposed as for the ambient image.
  cv::Mat1f room_light(const Scene& scene, std::size_t station, std::size_t tracker, int threads) const {
    const SceneStation& placed = scene.stations[station];
    const PreparedCamera& camera = trackers[tracker];
    if (!placed.in_view) return empty_room(camera, scene.lighting);
    const Pose world_from_seen = world_from_surface(placed);
    TransportSettings settings{scene.lighting, std::min(scene.samples, tracker_samples),
                               tracker_noise_seed(scene.seed, station, tracker, 0), threads};
    settings.body = scene.tracking.probe_body;
    if (settings.body) {
      settings.body->mount_from_box = placed.probe_from_surface.inverse() * settings.body->mount_from_box;
    }
    return Transport::trace(camera, nullptr, tracer(placed), world_from_seen, settings).radiance({});
  }

  cv::Mat1f with_spots(const Scene& scene, const cv::Mat1f& room, std::size_t station, std::size_t tracker_index,
                       std::size_t frame) const {
    const SceneStation& placed = scene.stations[station];
    const Tracking& tracking = scene.tracking;
    std::optional<Obstacle> obstacle;
    if (placed.in_view) obstacle = Obstacle{&tracer(placed), world_from_surface(placed).inverse()};
    const bool blinking = tracking.frames[frame].kind == FrameContent::Kind::leds;
    cv::Mat1f light;
    room.convertTo(light, CV_32F, blinking ? tracking.led_exposure : 1.0);
    draw_spots(spots_seen(scene, station, tracker_index, frame, obstacle),
               tracking.trackers[tracker_index].detector.exposure, light);
    return light;
  }
};

Renderer::Renderer(const Scene& scene, int threads)
    : scene_(scene), threads_(threads), prepared_(std::make_unique<const Prepared>(scene)) {}
Renderer::~Renderer() = default;

Expected<void> Renderer::render_station(std::size_t station, const FrameSink& sink) const {
  FirstError outcome;
  for (std::size_t camera = 0; camera < scene_.cameras.size(); ++camera) {
    const Transport transport = prepared_->transport(scene_, station, camera, threads_);
    const std::vector<FrameContent>& frames = frames_of(scene_, scene_.cameras[camera]);
    parallel_for(frames.size(), threads_, [&](std::size_t frame) {
      if (outcome.is_set()) return;
      const cv::Mat shown = projector_image(scene_, frames[frame]);
      const cv::Mat1f light =
          transport.radiance(shown.empty() ? cv::Mat1f() : emission(scene_.projector->emitter, shown));
      outcome.keep(
          sink({camera, frame,
                expose(scene_.cameras[camera].detector, light, noise_seed(scene_.seed, station, camera, frame))}));
    });
    if (outcome.is_set()) break;
  }
  return outcome.get();
}

Expected<void> Renderer::render_trackers(std::size_t station, const FrameSink& sink) const {
  FirstError outcome;
  const Tracking& tracking = scene_.tracking;
  for (std::size_t tracker = 0; tracker < tracking.trackers.size(); ++tracker) {
    const cv::Mat1f room = prepared_->room_light(scene_, station, tracker, threads_);
    parallel_for(tracking.frames.size(), threads_, [&](std::size_t frame) {
      if (outcome.is_set() || is_missing(scene_, station, tracker, frame)) return;
      const cv::Mat1f light = prepared_->with_spots(scene_, room, station, tracker, frame);
      const std::uint64_t seed = tracker_noise_seed(scene_.seed, station, tracker, frame);
      outcome.keep(sink({tracker, frame, expose(tracking.trackers[tracker].detector, light, seed)}));
    });
    if (outcome.is_set()) break;
  }
  return outcome.get();
}

cv::Mat1f Renderer::tracker_radiance(std::size_t station, std::size_t tracker, std::size_t frame) const {
  const cv::Mat1f room = prepared_->room_light(scene_, station, tracker, threads_);
  return prepared_->with_spots(scene_, room, station, tracker, frame);
}

std::vector<cv::Mat1f> Renderer::radiances(std::size_t station, std::size_t camera) const {
  const Transport transport = prepared_->transport(scene_, station, camera, threads_);
  const std::vector<FrameContent>& frames = frames_of(scene_, scene_.cameras[camera]);
  std::vector<cv::Mat1f> light(frames.size());
  parallel_for(light.size(), threads_, [&](std::size_t frame) {
    const cv::Mat shown = projector_image(scene_, frames[frame]);
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
