#include "datasets/render/led_spots.h"

#include <algorithm>
#include <cmath>

#include "datasets/render/light.h"
#include "datasets/render/sampling.h"

namespace crumple {
namespace {

constexpr double kTouching_mm = 1e-3;  // a light on a surface is not hidden by it

// What a draw decides; apart from the noise's streams.
enum class Chance : std::uint64_t { dropout = 0x6c6564, missing = 0x66696c65 };

bool happens(double probability, const Scene& scene, Chance what, std::initializer_list<std::size_t> which) {
  std::uint64_t bits = mix(scene.seed, static_cast<std::uint64_t>(what));
  for (const std::size_t index : which) bits = mix(bits, index);
  return static_cast<double>(bits >> 11) * 0x1p-53 < probability;
}

class SpotFinder {
 public:
  SpotFinder(const Scene& scene, const SceneStation& station, const SceneCamera& tracker,
             const std::optional<Obstacle>& obstacle)
      : scene_(scene),
        station_(station),
        tracker_(tracker),
        obstacle_(obstacle),
        eye_(tracker.sensor.sensor_from_mount.inverse().translation) {}

  Eigen::Vector3d position_of(const SceneLed& led) const {
    const bool on_probe = led.led.mount == Mount::probe;
    return on_probe ? station_.world_from_probe * led.led.position_mm : led.led.position_mm;
  }

  void see(const Eigen::Vector3d& light, double brightness, std::optional<std::size_t> led) {
    if (is_open(light, eye_)) add(light, brightness, led);
  }

  void see_reflected(const Eigen::Vector3d& light, double brightness, const Mirror& mirror) {
    const double light_above = mirror.normal.dot(light - mirror.centre_mm);
    const double eye_above = mirror.normal.dot(eye_ - mirror.centre_mm);
    if (light_above <= 0 || eye_above <= 0) return;
    const Eigen::Vector3d image = light - 2 * light_above * mirror.normal;
    const Eigen::Vector3d met = image + light_above / (light_above + eye_above) * (eye_ - image);
    if ((met - mirror.centre_mm).norm() > mirror.radius_mm) return;
    if (is_open(light, met) && is_open(met, eye_)) add(image, brightness * mirror.reflectance, {});
  }

  std::vector<LedSpot> spots;

 private:
  bool is_open(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    if (scene_.tracking.probe_body) {
      const Pose probe_from_world = station_.world_from_probe.inverse();
      if (stands_between(*scene_.tracking.probe_body, probe_from_world * from, probe_from_world * to)) return false;
    }
    if (!obstacle_) return true;
    const Eigen::Vector3d origin = obstacle_->surface_from_world * to;
    const Eigen::Vector3d target = obstacle_->surface_from_world * from;
    const auto hit = obstacle_->tracer->first_hit(origin, (target - origin).normalized());
    return !hit || (*hit - origin).norm() > (target - origin).norm() - kTouching_mm;
  }

  void add(const Eigen::Vector3d& light, double brightness, std::optional<std::size_t> led) {
    const Eigen::Vector3d in_tracker = tracker_.sensor.sensor_from_mount * light;
    if (in_tracker.z() <= 0) return;
    const auto pixel = tracker_.sensor.lens.project(in_tracker);
    if (!pixel) return;
    const Optics& optics = tracker_.optics;
    const double focal_px = tracker_.sensor.lens.parameters()[0];
    const double confusion_px =
        focal_px * optics.aperture_mm * std::abs(1 / in_tracker.z() - 1 / optics.focus_distance_mm);
    const double nearness = scene_.lighting.reference_distance_mm / in_tracker.norm();
    const double cosine = in_tracker.z() / in_tracker.norm();
    // A disc's variance along an axis is a sixteenth of its squared diameter.
    spots.push_back({*pixel, std::hypot(optics.blur_px, confusion_px / 4),
                     brightness * nearness * nearness * std::pow(cosine, 4), led});
  }

  const Scene& scene_;
  const SceneStation& station_;
  const SceneCamera& tracker_;
  const std::optional<Obstacle>& obstacle_;
  Eigen::Vector3d eye_;
};

}  // namespace

std::vector<LedSpot> spots_seen(const Scene& scene, std::size_t station, std::size_t tracker, std::size_t frame,
                                const std::optional<Obstacle>& obstacle) {
  const Tracking& tracking = scene.tracking;
  SpotFinder finder(scene, scene.stations[station], tracking.trackers[tracker], obstacle);
  const FrameContent& content = tracking.frames[frame];
  const bool blinking = content.kind == FrameContent::Kind::leds;
  for (std::size_t i = 0; i < tracking.leds.size() && blinking; ++i) {
    const SceneLed& led = tracking.leds[i];
    if (led.word[(content.step + tracking.blink_start) % led.word.size()] != '1') continue;
    if (happens(tracking.led_dropout, scene, Chance::dropout, {station, tracker, frame, i})) continue;
    const Eigen::Vector3d position = finder.position_of(led);
    finder.see(position, led.brightness, i);
    for (const Mirror& mirror : tracking.mirrors) finder.see_reflected(position, led.brightness, mirror);
  }
  // The room's light is exposed longer, and lamps with it.
  const double longer = blinking ? 1 : 1 / tracking.led_exposure;
  for (const Lamp& lamp : tracking.lamps) finder.see(lamp.position_mm, lamp.brightness * longer, {});
  return finder.spots;
}

void draw_spots(const std::vector<LedSpot>& spots, double full_wells_per_unit, cv::Mat1f& image) {
  for (const LedSpot& spot : spots) {
    const PixelSpread spread(1, spot.sigma_px);
    const Eigen::Vector2d reach = Eigen::Vector2d::Constant(spread.reach_px());
    const Eigen::Vector2d size(image.cols - 1, image.rows - 1);
    const Eigen::Vector2d low = (spot.centre_px - reach).cwiseMax(0).array().ceil();
    const Eigen::Vector2d high = (spot.centre_px + reach).cwiseMin(size).array().floor();
    for (double y = low.y(); y <= high.y(); ++y) {
      for (double x = low.x(); x <= high.x(); ++x) {
        const double share = spread.weight(spot.centre_px.x() - x) * spread.weight(spot.centre_px.y() - y);
        image(static_cast<int>(y), static_cast<int>(x)) += static_cast<float>(share * spot.light / full_wells_per_unit);
      }
    }
  }
}

bool is_missing(const Scene& scene, std::size_t station, std::size_t tracker, std::size_t frame) {
  return scene.tracking.frames[frame].kind == FrameContent::Kind::leds &&
         happens(scene.tracking.missing_frames, scene, Chance::missing, {station, tracker, frame});
}

}  // namespace crumple
