#include "datasets/simulate_yaml.h"

#include <algorithm>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "datasets/target_yaml.h"
#include "datasets/yaml_text.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr double kDegree = std::numbers::pi / 180;

std::string pose_text(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return fmt::format("{{quaternion_wxyz: [{}, {}, {}, {}], translation_mm: [{}, {}, {}]}}", q.w(), q.x(), q.y(), q.z(),
                     t.x(), t.y(), t.z());
}

bool is_thermal(const Scene& scene, const std::string& name) {
  return std::any_of(scene.cameras.begin(), scene.cameras.end(),
                     [&](const SceneCamera& camera) { return camera.thermal && camera.sensor.name == name; });
}

bool needs_version_3(const Scene& scene) {
  return !scene.tracking.trackers.empty() ||
         std::any_of(scene.cameras.begin(), scene.cameras.end(), [](const SceneCamera& c) { return c.thermal; });
}

std::string sensors_text(const Scene& scene) {
  std::string text = "sensors:\n";
  for (const Sensor& sensor : true_rig(scene).sensors) {
    const bool camera = sensor.kind == SensorKind::camera;
    text += fmt::format("  {}:\n    kind: {}\n    size_px: [{}, {}]\n    lens: {}\n", yaml_quoted(sensor.name),
                        camera ? "camera" : "projector", sensor.lens.size().width_px, sensor.lens.size().height_px,
                        sensor.lens.model());
    if (sensor.mount == Mount::world) text += "    mount: world\n";
    if (is_thermal(scene, sensor.name)) text += "    ambient_only: true\n";
    if (camera) text += "    files: \"{station}/{sensor}/{frame:03}.png\"\n";
  }
  return text;
}

std::string patterns_text(const Scene& scene) {
  if (!scene.projector) return {};
  std::string text = fmt::format("patterns:\n  projector: {}\n", yaml_quoted(scene.projector->sensor.name));
  if (!scene.orientations.empty()) text += "  orientations:\n";
  for (const StripeOrientation& orientation : scene.orientations) {
    text += fmt::format("    - {{angle_deg: {}, stripe_width_px: {}, bits: {}, code_offset: {}, inverse: {}}}\n",
                        orientation.angle_rad / kDegree, orientation.stripe_width_px, orientation.bits,
                        orientation.code_offset, orientation.inverse);
  }
  if (scene.projected_chessboard) {
    const ProjectedChessboard& board = *scene.projected_chessboard;
    text +=
        fmt::format("  chessboard: {{inner_corners: [{}, {}], first_corner_px: [{}, {}], pitch_px: {}}}\n",
                    board.columns, board.rows, board.first_corner_px.x(), board.first_corner_px.y(), board.pitch_px);
  }
  return text;
}

std::string frames_text(const std::string& key, const std::vector<FrameContent>& frames) {
  if (frames.empty()) return {};
  std::string text = key + ":\n";
  for (const FrameContent& frame : frames) {
    switch (frame.kind) {
      case Kind::ambient:
        text += "  - ambient\n";
        break;
      case Kind::white:
        text += "  - white\n";
        break;
      case Kind::black:
        text += "  - black\n";
        break;
      case Kind::chessboard:
        text += "  - chessboard\n";
        break;
      case Kind::stripes:
        text += fmt::format("  - {{orientation: {}, bit: {}, inverse: {}}}\n", frame.orientation, frame.bit,
                            frame.inverted);
        break;
      case Kind::leds:
        text += "  - {leds: 1}\n";
        break;
    }
  }
  return text;
}

std::string stations_text(const Scene& scene) {
  std::string text = "stations:\n";
  for (const SceneStation& station : scene.stations) {
    const bool board_here = station.board && station.in_view;
    text += fmt::format("  - {{id: {}", yaml_quoted(station.id));
    if (scene.board && !board_here) text += ", board: false";
    if (!station.placement.empty()) text += fmt::format(", placement: {}", yaml_quoted(station.placement));
    if (!station.scan) text += ", scan: false";
    if (!station.trackers) text += ", trackers: false";
    text += "}\n";
  }
  return text;
}

std::string leds_text(const Scene& scene) {
  if (scene.tracking.leds.empty()) return {};
  std::string text = "leds:\n";
  for (const SceneLed& led : scene.tracking.leds) {
    text += fmt::format("  {}: {{word: \"{}\"", yaml_quoted(led.led.name), led.word);
    if (led.led.mount == Mount::world) text += ", mount: world";
    if (led.nominal_mm) {
      text += fmt::format(", nominal_mm: [{}, {}, {}]", led.nominal_mm->x(), led.nominal_mm->y(), led.nominal_mm->z());
    }
    text += "}\n";
  }
  return text;
}

const char* surface_name(const SceneStation& station) {
  return station.object ? "object" : station.board ? "board" : "panel";
}

std::string object_text(const Scene& scene, const SceneStation& station) {
  if (!station.object) return {};
  return fmt::format("    object: {}\n", yaml_quoted(scene.objects[*station.object].name));
}

// Of a probe that is moved about: where it is, and where what it sees is.
std::string tracked_stations_text(const Scene& scene) {
  std::string text = "stations:\n";
  for (const SceneStation& station : scene.stations) {
    text += fmt::format("  - id: {}\n    world_from_probe: {}\n", yaml_quoted(station.id),
                        pose_text(station.world_from_probe));
    if (!station.placement.empty()) text += fmt::format("    placement: {}\n", yaml_quoted(station.placement));
    if (!station.in_view) continue;
    text += fmt::format("    world_from_{}: {}\n", surface_name(station), pose_text(world_from_surface(station)));
    text += object_text(scene, station);
  }
  return text;
}

}  // namespace

std::string capture_yaml(const Scene& scene) {
  std::string text =
      fmt::format("schema: crumple-capture/{}\ntitle: {}\n", needs_version_3(scene) ? 3 : 2, yaml_quoted(scene.name)) +
      sensors_text(scene);
  if (scene.board) {
    text += fmt::format("board: {{{}}}\n", target_yaml(scene.board->target()));
  }
  return text + leds_text(scene) + patterns_text(scene) + frames_text("frames", scene.frames) +
         frames_text("tracker_frames", scene.tracking.frames) + stations_text(scene);
}

std::string true_stations_yaml(const Scene& scene) {
  const bool tracked = !scene.tracking.trackers.empty();
  std::string text = tracked ? "schema: crumple-true-stations/2\n" : "";
  if (scene.board) {
    const Eigen::Vector2d& warp = scene.board->board().warp_mm;
    text += fmt::format("board: {{{}, warp_mm: [{}, {}]}}\n", target_yaml(scene.board->target()), warp.x(), warp.y());
  }
  if (tracked) return text + tracked_stations_text(scene);
  text += "stations:\n";
  for (const SceneStation& station : scene.stations) {
    text += fmt::format("  - id: {}\n    probe_from_{}: {}\n", yaml_quoted(station.id), surface_name(station),
                        pose_text(station.probe_from_surface));
    text += object_text(scene, station);
  }
  return text;
}

}  // namespace crumple
