#include "datasets/simulate_yaml.h"

#include <numbers>

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

std::string sensors_text(const Scene& scene) {
  std::string text = "sensors:\n";
  for (const Sensor& sensor : true_rig(scene).sensors) {
    const bool camera = sensor.kind == SensorKind::camera;
    text += fmt::format("  {}:\n    kind: {}\n    size_px: [{}, {}]\n    lens: {}\n", yaml_quoted(sensor.name),
                        camera ? "camera" : "projector", sensor.lens.size().width_px, sensor.lens.size().height_px,
                        sensor.lens.model());
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

std::string frames_text(const Scene& scene) {
  std::string text = "frames:\n";
  for (const FrameContent& frame : scene.frames) {
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
    }
  }
  return text;
}

std::string stations_text(const Scene& scene) {
  std::string text = "stations:\n";
  for (const SceneStation& station : scene.stations) {
    const bool stray = scene.board && !station.board;  // a board is described, but it is not here
    text += fmt::format("  - {{id: {}{}}}\n", yaml_quoted(station.id), stray ? ", board: false" : "");
  }
  return text;
}

}  // namespace

std::string capture_yaml(const Scene& scene) {
  std::string text =
      fmt::format("schema: crumple-capture/2\ntitle: {}\n", yaml_quoted(scene.name)) + sensors_text(scene);
  if (scene.board) {
    text += fmt::format("board: {{{}}}\n", target_yaml(scene.board->target()));
  }
  return text + patterns_text(scene) + frames_text(scene) + stations_text(scene);
}

std::string true_stations_yaml(const Scene& scene) {
  std::string text;
  if (scene.board) {
    const Eigen::Vector2d& warp = scene.board->board().warp_mm;
    text += fmt::format("board: {{{}, warp_mm: [{}, {}]}}\n", target_yaml(scene.board->target()), warp.x(), warp.y());
  }
  text += "stations:\n";
  for (const SceneStation& station : scene.stations) {
    text += fmt::format("  - id: {}\n    {}: {}\n", yaml_quoted(station.id),
                        station.board ? "probe_from_board" : "probe_from_panel", pose_text(station.probe_from_surface));
  }
  return text;
}

}  // namespace crumple
