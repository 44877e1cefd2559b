#include "datasets/render/transport.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include <opencv2/core.hpp>

#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr int lane = 4;                // window widths are multiples of it
constexpr int largest_window_px = 24;  // samples further apart get windows of their own
constexpr double body_albedo = 0.06;
constexpr std::uint64_t bounce_stream = 0x626f756e6365;
constexpr double bounce_lift_mm = 0.1;  // clear of the mesh, as shadow rays are
constexpr int refinement = 4;           // times as many samples where the first ones differ in kind

double widest_panel_slope(const Lens& lens) {
  double widest = 0;
  const double right = lens.size().width_px - 0.5;
  const double bottom = lens.size().height_px - 0.5;
  constexpr int steps = 32;
  for (int i = 0; i <= steps; ++i) {
    const double x = -0.5 + (right + 0.5) * i / steps;
    const double y = -0.5 + (bottom + 0.5) * i / steps;
    for (const Eigen::Vector2d& edge :
         {Eigen::Vector2d(x, -0.5), Eigen::Vector2d(x, bottom), Eigen::Vector2d(-0.5, y), Eigen::Vector2d(right, y)}) {
      const auto ray = lens.ray(edge);
      if (ray && ray->z() > 0) widest = std::max(widest, ray->head<2>().norm());
    }
  }
  constexpr double allowance = 1.05;
  return allowance * widest;
}

}  // namespace

RayField::RayField(const Lens& lens, double margin_px)
    : margin_px_(static_cast<int>(std::ceil(margin_px)) + 1), width_px_(lens.size().width_px + 2 * margin_px_) {
  const int bottom = lens.size().height_px + margin_px_;
  const int right = lens.size().width_px + margin_px_;
  for (int y = -margin_px_; y < bottom; ++y) {
    for (int x = -margin_px_; x < right; ++x) {
      const auto ray = lens.ray(Eigen::Vector2d(x, y));
      rays_.push_back(ray && ray->z() > 0 ? Eigen::Vector2d(ray->head<2>())
                                          : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
  }
}

std::optional<Eigen::Vector3d> RayField::at(double x, double y) const {
  const double left = std::floor(x);
  const double top = std::floor(y);
  const auto index =
      static_cast<std::size_t>((static_cast<int>(top) + margin_px_) * width_px_ + static_cast<int>(left) + margin_px_);
  const auto stride = static_cast<std::size_t>(width_px_);
  const double u = x - left;
  const double v = y - top;
  const Eigen::Vector2d upper = (1 - u) * rays_[index] + u * rays_[index + 1];
  const Eigen::Vector2d lower = (1 - u) * rays_[index + stride] + u * rays_[index + stride + 1];
  const Eigen::Vector2d slope = (1 - v) * upper + v * lower;
  if (!slope.allFinite()) return std::nullopt;
  return Eigen::Vector3d(slope.x(), slope.y(), 1);
}

PreparedCamera::PreparedCamera(const SceneCamera& scene_camera)
    : camera(scene_camera),
      footprint(scene_camera.optics.blur_px),
      rays(scene_camera.sensor.lens, footprint.reach_px()) {}

PreparedProjector::PreparedProjector(const SceneProjector& scene_projector)
    : projector(scene_projector),
      spread(scene_projector.emitter.pixel_fill, scene_projector.optics.blur_px),
      widest_slope(widest_panel_slope(scene_projector.sensor.lens)) {}

std::optional<Eigen::Vector2d> PreparedProjector::pixel_towards(const Eigen::Vector3d& point,
                                                                const Eigen::Vector3d& lens_point,
                                                                double margin_px) const {
  if (point.z() <= 0) return std::nullopt;
  const Eigen::Vector3d in_focus = lens_point + projector.optics.focus_distance_mm / point.z() * (point - lens_point);
  if (in_focus.head<2>().norm() > widest_slope * in_focus.z()) return std::nullopt;
  const Lens& lens = projector.sensor.lens;
  const auto pixel = lens.project(in_focus);
  const bool on_panel = pixel && pixel->x() > -margin_px && pixel->x() < lens.size().width_px - 1 + margin_px &&
                        pixel->y() > -margin_px && pixel->y() < lens.size().height_px - 1 + margin_px;
  if (!on_panel) return std::nullopt;
  return pixel;
}

// Traces one row of camera pixels; everything geometric is in the surface frame.
class RowTracer {
 public:
  RowTracer(const PreparedCamera& camera, const PreparedProjector* projector, const Tracer& tracer,
            const Pose& mount_from_surface, const TransportSettings& settings)
      : camera_(camera), projector_(projector), tracer_(tracer), settings_(settings) {
    surface_from_camera_ = (camera.camera.sensor.sensor_from_mount * mount_from_surface).inverse();
    if (settings.body) box_from_surface_ = settings.body->mount_from_box.inverse();
    if (!projector) return;
    projector_from_surface_ = projector->projector.sensor.sensor_from_mount * mount_from_surface;
    surface_from_projector_ = projector_from_surface_.inverse();
  }

  Transport::Row operator()(int y, int width) {
    Transport::Row row;
    row.ambient.reserve(static_cast<std::size_t>(width));
    row.window_counts.reserve(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) trace_pixel(x, y, row);
    return row;
  }

 private:
  // What a sample found on the projector's panel, and what light reaches the camera from there.
  struct Spot {
    Eigen::Vector2d projector_pixel;
    double reflectance;
  };

  // Samples of one pixel that come out differently call for more of them: an edge runs through it.
  struct Outcome {
    double albedo = -1;  // of what was met; negative where nothing was
    bool lit = false;
    bool operator==(const Outcome&) const = default;
  };

  void trace_pixel(int x, int y, Transport::Row& row) {
    pixel_bits_ = mix(mix(settings_.seed, static_cast<std::uint64_t>(y)), static_cast<std::uint64_t>(x));
    spots_.clear();
    ambient_ = 0;
    int count = settings_.samples;
    const Outcome first = trace_sample(x, y, 0);
    bool edge = false;
    for (int i = 1; i < count; ++i) edge |= trace_sample(x, y, i) != first;
    if (edge) {
      count *= refinement;
      for (int i = settings_.samples; i < count; ++i) trace_sample(x, y, i);
    }
    row.ambient.push_back(static_cast<float>(ambient_ / count));
    gather(count, row);
  }

  Outcome trace_sample(int x, int y, int i) {
    const auto index = static_cast<std::uint32_t>(i);
    const Eigen::Vector2d unit = sample_point(index, SampleUse::footprint, pixel_bits_);
    const Footprint& footprint = camera_.footprint;
    const auto ray = camera_.rays.at(x + footprint.offset_px(unit.x()), y + footprint.offset_px(unit.y()));
    if (!ray) return {};
    const Optics& optics = camera_.camera.optics;
    const Eigen::Vector3d lens_point = aperture_point(optics, index, SampleUse::camera_aperture);
    const Eigen::Vector3d in_focus = optics.focus_distance_mm * *ray;
    const Eigen::Vector3d origin = surface_from_camera_ * lens_point;
    const Eigen::Vector3d direction = (surface_from_camera_.rotation * (in_focus - lens_point)).normalized();
    const double vignetting = 1 / (ray->squaredNorm() * ray->squaredNorm());

    const auto hit = tracer_.first_hit(origin, direction);
    if (settings_.body && body_is_before(origin, direction, hit)) {
      ambient_ += vignetting * settings_.lighting.ambient * body_albedo;
      return {body_albedo, false};
    }
    if (!hit) {
      const Lighting& lighting = settings_.lighting;
      const double beyond =
          camera_.camera.thermal ? lighting.thermal_background : lighting.ambient * lighting.background;
      ambient_ += vignetting * beyond;
      return {};
    }
    const SurfacePoint point = tracer_.surface().at(hit->x(), hit->y());
    const Material material = tracer_.surface().material(hit->x(), hit->y());
    if (camera_.camera.thermal) {
      ambient_ += vignetting * material.thermal;
      return {material.thermal, false};
    }
    if (settings_.lighting.bounce && projector_) bounce(point, material, vignetting, index);
    ambient_ += vignetting * settings_.lighting.ambient * ambient_reflectance(material, point.normal, -direction);
    return {material.albedo, projector_ && light_up(point, material, -direction, vignetting, index)};
  }

  bool body_is_before(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                      const std::optional<Eigen::Vector3d>& hit) const {
    const auto t = entry(*settings_.body, box_from_surface_ * origin, box_from_surface_.rotation * direction);
    return t && (!hit || *t < (*hit - origin).norm());
  }

  // The projector's light that comes to a point over a second one: from one direction, chosen by Lambert's law.
  void bounce(const SurfacePoint& point, const Material& material, double vignetting, std::uint32_t index) {
    const Eigen::Vector2d disc = on_disc(sample_point(index, SampleUse::footprint, mix(pixel_bits_, bounce_stream)));
    const Eigen::Vector3d x = point.normal.unitOrthogonal();
    const Eigen::Vector3d direction = disc.x() * x + disc.y() * point.normal.cross(x) +
                                      std::sqrt(std::max(0.0, 1 - disc.squaredNorm())) * point.normal;
    const auto second = tracer_.first_hit(point.position_mm + bounce_lift_mm * point.normal, direction);
    if (!second) return;
    const SurfacePoint from = tracer_.surface().at(second->x(), second->y());
    if (from.normal.dot(direction) >= 0) return;
    light_up(from, tracer_.surface().material(second->x(), second->y()), -direction, vignetting * material.albedo,
             index);
  }

  // Whether the projector lights the point; if so, adds its spot on the panel.
  bool light_up(const SurfacePoint& point, const Material& material, const Eigen::Vector3d& to_viewer,
                double vignetting, std::uint32_t index) {
    const Eigen::Vector3d lens_point =
        aperture_point(projector_->projector.optics, index, SampleUse::projector_aperture);
    const Eigen::Vector3d in_projector = projector_from_surface_ * point.position_mm;
    const auto pixel = projector_->pixel_towards(in_projector, lens_point, projector_->spread.reach_px());
    if (!pixel) return false;
    const Eigen::Vector3d light = surface_from_projector_ * lens_point;
    const Eigen::Vector3d to_light = (light - point.position_mm).normalized();
    const double cosine = point.normal.dot(to_light);
    if (cosine <= 0 || tracer_.shadowed(point, light)) return false;
    const double irradiance = projector_irradiance(in_projector, cosine, settings_.lighting.reference_distance_mm);
    spots_.push_back({*pixel, vignetting * irradiance * reflectance(material, point.normal, to_light, to_viewer)});
    return true;
  }

  Eigen::Vector3d aperture_point(const Optics& optics, std::uint32_t index, SampleUse use) const {
    if (optics.aperture_mm <= 0) return Eigen::Vector3d::Zero();
    const Eigen::Vector2d p = optics.aperture_mm / 2 * on_disc(sample_point(index, use, pixel_bits_));
    return {p.x(), p.y(), 0};
  }

  // Spreads the spots over the panel's pixels, nearby ones into one window.
  void gather(int count, Transport::Row& row) {
    std::size_t windows = 0;
    while (!spots_.empty()) {
      Eigen::Vector2d low = spots_.front().projector_pixel;
      Eigen::Vector2d high = low;
      group_.clear();
      rest_.clear();
      for (const Spot& spot : spots_) {
        const Eigen::Vector2d new_low = low.cwiseMin(spot.projector_pixel);
        const Eigen::Vector2d new_high = high.cwiseMax(spot.projector_pixel);
        if ((new_high - new_low).maxCoeff() > largest_window_px) {
          rest_.push_back(spot);
          continue;
        }
        low = new_low;
        high = new_high;
        group_.push_back(spot);
      }
      if (add_window(low, high, count, row)) ++windows;
      std::swap(spots_, rest_);
    }
    assert(windows < 256);
    row.window_counts.push_back(static_cast<std::uint8_t>(windows));
  }

  bool add_window(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int count, Transport::Row& row) {
    const double reach = projector_->spread.reach_px();
    const ImageSize size = projector_->projector.sensor.lens.size();
    const int left = std::max(0, static_cast<int>(std::ceil(low.x() - reach)));
    const int top = std::max(0, static_cast<int>(std::ceil(low.y() - reach)));
    const int right = std::min(size.width_px - 1, static_cast<int>(std::floor(high.x() + reach)));
    const int bottom = std::min(size.height_px - 1, static_cast<int>(std::floor(high.y() + reach)));
    if (right < left || bottom < top) return false;
    const int width = (right - left + lane) / lane * lane;
    const int height = bottom - top + 1;
    const std::size_t start = row.weights.size();
    row.weights.resize(start + static_cast<std::size_t>(width * height), 0.0F);
    row.windows.push_back({static_cast<std::uint16_t>(left), static_cast<std::uint16_t>(top),
                           static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height)});
    along_x_.resize(static_cast<std::size_t>(width));
    for (const Spot& spot : group_) {
      for (int i = 0; i < width; ++i) {
        along_x_[static_cast<std::size_t>(i)] =
            static_cast<float>(left + i > right ? 0 : projector_->spread.weight(spot.projector_pixel.x() - (left + i)));
      }
      float* weight = row.weights.data() + start;
      for (int j = top; j <= bottom; ++j) {
        const auto along_y =
            static_cast<float>(spot.reflectance / count * projector_->spread.weight(spot.projector_pixel.y() - j));
        for (int i = 0; i < width; ++i) *weight++ += along_y * along_x_[static_cast<std::size_t>(i)];
      }
    }
    return true;
  }

  const PreparedCamera& camera_;
  const PreparedProjector* projector_;
  const Tracer& tracer_;
  const TransportSettings& settings_;
  Pose surface_from_camera_;
  Pose projector_from_surface_;
  Pose surface_from_projector_;
  Pose box_from_surface_;
  std::vector<Spot> spots_, group_, rest_;
  std::vector<float> along_x_;
  double ambient_ = 0;
  std::uint64_t pixel_bits_ = 0;
};

Transport Transport::trace(const PreparedCamera& camera, const PreparedProjector* projector, const Tracer& tracer,
                           const Pose& mount_from_surface, const TransportSettings& settings) {
  const ImageSize size = camera.camera.sensor.lens.size();
  Transport transport;
  transport.size_ = size;
  transport.rows_.resize(static_cast<std::size_t>(size.height_px));
  parallel_for(transport.rows_.size(), settings.threads, [&](std::size_t y) {
    transport.rows_[y] =
        RowTracer(camera, projector, tracer, mount_from_surface, settings)(static_cast<int>(y), size.width_px);
  });
  return transport;
}

cv::Mat1f Transport::radiance(const cv::Mat1f& emission) const {
  cv::Mat1f padded;  // windows may reach past the right edge, where their weights are zero
  if (!emission.empty()) cv::copyMakeBorder(emission, padded, 0, 0, 0, lane - 1, cv::BORDER_CONSTANT, 0);
  cv::Mat1f image(size_.height_px, size_.width_px);
  for (int y = 0; y < size_.height_px; ++y) {
    const Row& row = rows_[static_cast<std::size_t>(y)];
    if (emission.empty()) {
      std::copy(row.ambient.begin(), row.ambient.end(), image[y]);
    } else {
      light_row(row, padded, image[y]);
    }
  }
  return image;
}

void Transport::light_row(const Row& row, const cv::Mat1f& emission, float* radiance) {
  const Window* window = row.windows.data();
  const float* weight = row.weights.data();
  for (std::size_t x = 0; x < row.ambient.size(); ++x) {
    std::array<float, lane> sums{};
    for (int i = 0; i < row.window_counts[x]; ++i, ++window) {
      for (int j = window->top; j < window->top + window->height; ++j) {
        const float* emitted = emission[j] + window->left;
        for (int k = 0; k < window->width; k += lane, weight += lane, emitted += lane) {
          for (std::size_t l = 0; l < lane; ++l) sums[l] += weight[l] * emitted[l];
        }
      }
    }
    radiance[x] = row.ambient[x] + (sums[0] + sums[1]) + (sums[2] + sums[3]);
  }
}

}  // namespace crumple
