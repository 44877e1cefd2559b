#include "datasets/render/scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

namespace crumple {
namespace {

cv::Mat draw_chessboard(const ProjectedChessboard& board, ImageSize size) {
  cv::Mat image(size.height_px, size.width_px, CV_8U, cv::Scalar(255));
  for (int y = 0; y < size.height_px; ++y) {
    for (int x = 0; x < size.width_px; ++x) {
      const int column = static_cast<int>(std::floor((x - board.first_corner_px.x()) / board.pitch_px));
      const int row = static_cast<int>(std::floor((y - board.first_corner_px.y()) / board.pitch_px));
      const bool on_squares = column >= -1 && column < board.columns && row >= -1 && row < board.rows;
      if (on_squares && (column + row) % 2 == 0) image.at<std::uint8_t>(y, x) = 0;
    }
  }
  return image;
}

}  // namespace

Rig true_rig(const Scene& scene) {
  Rig rig;
  for (const SceneCamera& camera : scene.cameras) rig.sensors.push_back(camera.sensor);
  if (scene.projector) rig.sensors.push_back(scene.projector->sensor);
  for (const SceneCamera& tracker : scene.tracking.trackers) rig.sensors.push_back(tracker.sensor);
  rig.sensors.insert(rig.sensors.end(), scene.dark_projectors.begin(), scene.dark_projectors.end());
  for (const SceneLed& led : scene.tracking.leds) rig.leds.push_back(led.led);
  return rig;
}

const std::vector<FrameContent>& frames_of(const Scene& scene, const SceneCamera& camera) {
  static const std::vector<FrameContent> ambient = {FrameContent{}};
  return camera.thermal ? ambient : scene.frames;
}

Pose world_from_surface(const SceneStation& station) { return station.world_from_probe * station.probe_from_surface; }

const Surface& surface_at(const Scene& scene, const SceneStation& station) {
  assert(station.in_view);
  if (station.object) return *scene.objects[*station.object].surface;
  if (station.board) {
    assert(scene.board);
    return *scene.board;
  }
  assert(scene.panel);
  return *scene.panel;
}

std::vector<FrameContent> stripe_frames(const std::vector<StripeOrientation>& orientations) {
  std::vector<FrameContent> frames;
  for (std::size_t i = 0; i < orientations.size(); ++i) {
    for (int bit = 0; bit < orientations[i].bits; ++bit) {
      frames.push_back({FrameContent::Kind::stripes, i, bit, false});
      if (orientations[i].inverse) frames.push_back({FrameContent::Kind::stripes, i, bit, true});
    }
  }
  return frames;
}

cv::Mat projector_image(const Scene& scene, const FrameContent& frame) {
  if (frame.kind == FrameContent::Kind::ambient) return {};
  assert(scene.projector);
  const ImageSize size = scene.projector->sensor.lens.size();
  switch (frame.kind) {
    case FrameContent::Kind::stripes:
      return draw_stripes(scene.orientations[frame.orientation], size, frame.bit, frame.inverted);
    case FrameContent::Kind::chessboard:
      assert(scene.projected_chessboard);
      return draw_chessboard(*scene.projected_chessboard, size);
    default:
      return cv::Mat(size.height_px, size.width_px, CV_8U,
                     cv::Scalar(frame.kind == FrameContent::Kind::white ? 255 : 0));
  }
}

namespace {

// One camera and one placement, in the board's frame.
struct SensorView {
  const Surface& surface;
  const Lens& lens;
  Pose sensor_from_surface;
  Pose surface_from_sensor;

  SensorView(const Surface& seen, const Sensor& sensor, const Pose& mount_from_surface)
      : surface(seen),
        lens(sensor.lens),
        sensor_from_surface(sensor.sensor_from_mount * mount_from_surface),
        surface_from_sensor(sensor_from_surface.inverse()) {}

  std::optional<Eigen::Vector3d> point_at(const Eigen::Vector2d& pixel) const {
    const std::optional<Eigen::Vector3d> ray = lens.ray(pixel);
    if (!ray) return std::nullopt;
    const Eigen::Vector3d origin = surface_from_sensor.translation;
    const Eigen::Vector3d direction = surface_from_sensor.rotation * *ray;
    const double t_plane = -origin.z() / direction.z();
    if (!(t_plane > 0)) return std::nullopt;
    const std::optional<double> t = surface.meet(origin, direction, t_plane);
    if (!t) return std::nullopt;
    return origin + *t * direction;
  }

  std::optional<Eigen::Vector2d> pixel_of(const Eigen::Vector3d& point) const {
    const auto pixel = lens.project(sensor_from_surface * point);
    if (!pixel || !lens.size().contains(*pixel)) return std::nullopt;
    return pixel;
  }
};

CornerView corners_seen(const Board& board, const SensorView& camera) {
  CornerView view;
  for (int index = 0; index < board.point_count(); ++index) {
    if (const std::optional<Eigen::Vector2d> pixel = camera.pixel_of(board.point(index))) {
      view.corners.push_back(index);
      view.pixels.push_back(*pixel);
    }
  }
  return view;
}

// Camera pixels on a grid, and the projector pixels they meet on the board.
struct Matches {
  std::vector<Eigen::Vector2d> camera_pixels;
  std::vector<Eigen::Vector2d> projector_pixels;
};

Matches matches_on_grid(const SensorView& camera, const SensorView& projector, int step_px) {
  Matches matches;
  for (int y = step_px / 2; y < camera.lens.size().height_px; y += step_px) {
    for (int x = step_px / 2; x < camera.lens.size().width_px; x += step_px) {
      const std::optional<Eigen::Vector3d> point = camera.point_at(Eigen::Vector2d(x, y));
      if (!point) continue;
      if (const std::optional<Eigen::Vector2d> lit_by = projector.pixel_of(*point)) {
        matches.camera_pixels.emplace_back(x, y);
        matches.projector_pixels.push_back(*lit_by);
      }
    }
  }
  return matches;
}

FeatureView features_seen(const ProjectedChessboard& chessboard, const SensorView& camera,
                          const SensorView& projector) {
  FeatureView view;
  for (int row = 0; row < chessboard.rows; ++row) {
    for (int column = 0; column < chessboard.columns; ++column) {
      const Eigen::Vector2d cast = chessboard.first_corner_px + chessboard.pitch_px * Eigen::Vector2d(column, row);
      const std::optional<Eigen::Vector3d> point = projector.point_at(cast);
      if (!point) continue;
      if (const std::optional<Eigen::Vector2d> pixel = camera.pixel_of(*point)) {
        view.projector_pixels.push_back(cast);
        view.camera_pixels.push_back(*pixel);
      }
    }
  }
  return view;
}

// Numbers the places of the board in the order of the stations.
class PlacementNumbers {
 public:
  std::size_t operator()(const SceneStation& station) {
    if (station.placement.empty()) return count_++;
    const auto [known, is_new] = numbers_.emplace(station.placement, count_);
    if (is_new) ++count_;
    return known->second;
  }
  std::size_t count() const { return count_; }

 private:
  std::map<std::string, std::size_t> numbers_;
  std::size_t count_ = 0;
};

// What the probe's sensors see of the board at one station.
void add_scan(const Scene& scene, const SceneStation& station, std::size_t placement,
              std::optional<std::size_t> station_index, int grid_step_px, Observations& observations) {
  const std::size_t projector_index = scene.cameras.size();
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const SensorView camera(*scene.board, scene.cameras[i].sensor, station.probe_from_surface);
    CornerView corners = corners_seen(scene.board->board(), camera);
    corners.sensor = i;
    corners.placement = placement;
    corners.station = station_index;
    observations.corners.push_back(std::move(corners));
    if (!scene.projector || scene.cameras[i].thermal) continue;

    const SensorView projector(*scene.board, scene.projector->sensor, station.probe_from_surface);
    const Matches matches = matches_on_grid(camera, projector, grid_step_px);
    for (const StripeOrientation& orientation : scene.orientations) {
      StripeView stripes{i, projector_index, placement, orientation.normal(), matches.camera_pixels, {}, station_index};
      for (const Eigen::Vector2d& pixel : matches.projector_pixels) {
        stripes.coordinates_px.push_back(orientation.normal().dot(pixel));
      }
      observations.stripes.push_back(std::move(stripes));
    }
    if (scene.projected_chessboard) {
      FeatureView features = features_seen(*scene.projected_chessboard, camera, projector);
      features.projector = projector_index;
      features.camera = i;
      features.placement = placement;
      features.station = station_index;
      observations.features.push_back(std::move(features));
    }
  }
}

// What the trackers see of the LEDs at one station.
void add_led_views(const Scene& scene, std::size_t station_index, Observations& observations) {
  const SceneStation& station = scene.stations[station_index];
  const Tracking& tracking = scene.tracking;
  const std::size_t first_tracker = scene.cameras.size() + (scene.projector ? 1 : 0);
  for (std::size_t t = 0; t < tracking.trackers.size(); ++t) {
    const Sensor& tracker = tracking.trackers[t].sensor;
    LedView view{first_tracker + t, {}, {}, station_index};
    for (std::size_t i = 0; i < tracking.leds.size(); ++i) {
      const Led& led = tracking.leds[i].led;
      const Eigen::Vector3d in_world =
          led.mount == Mount::probe ? station.world_from_probe * led.position_mm : led.position_mm;
      const auto pixel = tracker.lens.project(tracker.sensor_from_mount * in_world);
      if (!pixel || !tracker.lens.size().contains(*pixel)) continue;
      view.leds.push_back(i);
      view.pixels.push_back(*pixel);
    }
    observations.leds.push_back(std::move(view));
  }
}

// What the trackers see of the board; once a station, for each takes an image of its own.
void add_tracker_corners(const Scene& scene, const SceneStation& station, std::size_t placement,
                         Observations& observations) {
  const std::size_t first_tracker = scene.cameras.size() + (scene.projector ? 1 : 0);
  for (std::size_t t = 0; t < scene.tracking.trackers.size(); ++t) {
    const SensorView tracker(*scene.board, scene.tracking.trackers[t].sensor, world_from_surface(station));
    CornerView corners = corners_seen(scene.board->board(), tracker);
    corners.sensor = first_tracker + t;
    corners.placement = placement;
    observations.corners.push_back(std::move(corners));
  }
}

}  // namespace

Observations ideal_observations(const Scene& scene, int grid_step_px) {
  assert(grid_step_px > 0);
  Observations observations;
  PlacementNumbers placements;
  const bool tracked = !scene.tracking.trackers.empty();
  const bool boards_in_trackers =
      std::any_of(scene.tracking.frames.begin(), scene.tracking.frames.end(),
                  [](const FrameContent& frame) { return frame.kind == FrameContent::Kind::ambient; });
  for (std::size_t s = 0; s < scene.stations.size(); ++s) {
    const SceneStation& station = scene.stations[s];
    if (tracked && station.trackers) add_led_views(scene, s, observations);
    if (!station.board || !station.in_view) continue;
    const std::size_t placement = placements(station);
    const std::optional<std::size_t> index = tracked ? std::optional(s) : std::nullopt;
    if (station.scan) add_scan(scene, station, placement, index, grid_step_px, observations);
    if (station.trackers && boards_in_trackers) add_tracker_corners(scene, station, placement, observations);
  }
  observations.placement_count = placements.count();
  return observations;
}

}  // namespace crumple
