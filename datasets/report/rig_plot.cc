#include "datasets/report/rig_plot.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "datasets/round_number.h"

namespace crumple {
namespace {

using Polyline = std::vector<Eigen::Vector3d>;  // world frame, mm

struct RigScene {
  std::vector<Polyline> cameras, projectors, boards;
  std::vector<Eigen::Vector3d> leds, probes;
  std::vector<std::pair<Eigen::Vector3d, std::string>> names;  // of the sensors, at their centres
};

// Where the probe was first; of one that stands still the world's frame is its own.
Pose world_from_first_probe(const CalibrationState& state) {
  return state.world_from_probe.empty() ? Pose{} : state.world_from_probe.front();
}

Polyline board_outline(const CalibrationState& state, std::size_t placement) {
  const Board& board = state.board_at(placement);
  Eigen::Vector2d low = board.nominal_mm().front(), high = low;
  for (const Eigen::Vector2d& point : board.nominal_mm()) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Polyline outline;
  for (const Eigen::Vector2d& corner :
       {low, Eigen::Vector2d(high.x(), low.y()), high, Eigen::Vector2d(low.x(), high.y()), low}) {
    outline.push_back(state.world_from_board[placement] * board.on_surface(corner));
  }
  return outline;
}

Eigen::AlignedBox3d bounds_mm(const RigScene& scene) {
  Eigen::AlignedBox3d box;
  for (const auto* const lines : {&scene.cameras, &scene.projectors, &scene.boards}) {
    for (const Polyline& line : *lines) {
      for (const Eigen::Vector3d& point : line) box.extend(point);
    }
  }
  for (const Eigen::Vector3d& point : scene.leds) box.extend(point);
  for (const Eigen::Vector3d& point : scene.probes) box.extend(point);
  for (const auto& [centre, name] : scene.names) box.extend(centre);
  return box;
}

// A ray towards a corner of the image, or as far out as the lens has one.
std::optional<Eigen::Vector3d> corner_ray(const Lens& lens, double right, double down) {
  const Eigen::Vector2d middle(lens.size().width_px / 2.0 - 0.5, lens.size().height_px / 2.0 - 0.5);
  const Eigen::Vector2d half(lens.size().width_px / 2.0 * right, lens.size().height_px / 2.0 * down);
  for (double share = 1; share > 0.3; share -= 0.1) {
    if (const auto ray = lens.ray(middle + share * half)) return ray;
  }
  return std::nullopt;
}

// Edges of the pyramid, as one line where it can be drawn in one go: apex to corners, and round the base.
std::vector<Polyline> frustum(const Sensor& sensor, const Pose& world_from_mount, double length_mm) {
  const Pose world_from_sensor = world_from_mount * sensor.sensor_from_mount.inverse();
  Polyline base;
  for (const auto& [right, down] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
    if (const auto ray = corner_ray(sensor.lens, right, down)) {
      base.push_back(world_from_sensor * Eigen::Vector3d(*ray * (length_mm / std::max(1.0, ray->norm() / 1.5))));
    }
  }
  std::vector<Polyline> edges;
  for (const Eigen::Vector3d& corner : base) edges.push_back({world_from_sensor.translation, corner});
  if (!base.empty()) {
    base.push_back(base.front());
    edges.push_back(std::move(base));
  }
  return edges;
}

RigScene scene_of(const CalibrationState& state) {
  RigScene scene;
  const Pose probe = world_from_first_probe(state);
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) scene.boards.push_back(board_outline(state, p));
  for (const Led& led : state.rig.leds) {
    scene.leds.emplace_back((led.mount == Mount::probe ? probe : Pose{}) * led.position_mm);
  }
  for (const Pose& pose : state.world_from_probe) scene.probes.push_back(pose.translation);
  for (const Sensor& sensor : state.rig.sensors) {
    const Pose world_from_mount = sensor.mount == Mount::probe ? probe : Pose{};
    scene.names.emplace_back((world_from_mount * sensor.sensor_from_mount.inverse()).translation, sensor.name);
  }
  const double length_mm = 0.13 * bounds_mm(scene).diagonal().norm();
  for (const Sensor& sensor : state.rig.sensors) {
    auto& edges = sensor.kind == SensorKind::camera ? scene.cameras : scene.projectors;
    for (Polyline& edge : frustum(sensor, sensor.mount == Mount::probe ? probe : Pose{}, length_mm)) {
      edges.push_back(std::move(edge));
    }
  }
  return scene;
}

// gnuplot's axes: x, z, -y; lines are told apart by empty ones.
std::string lines_data(const std::string& name, const std::vector<Polyline>& lines) {
  std::vector<std::vector<double>> rows;
  for (const Polyline& line : lines) {
    for (const Eigen::Vector3d& point : line) rows.push_back({point.x(), point.z(), -point.y()});
    rows.insert(rows.end(), 2, {});
  }
  return gnuplot_data(name, rows);
}

std::string points_data(const std::string& name, const std::vector<Eigen::Vector3d>& points) {
  std::vector<std::vector<double>> rows;
  for (const Eigen::Vector3d& point : points) rows.push_back({point.x(), point.z(), -point.y()});
  return gnuplot_data(name, rows);
}

std::string scene_data(const RigScene& scene) {
  return lines_data("cameras", scene.cameras) + lines_data("projectors", scene.projectors) +
         lines_data("boards", scene.boards) + points_data("leds", scene.leds) + points_data("probes", scene.probes);
}

// `columns` are gnuplot's for one point: "1:2:3" in space, "2:1" on the plan.
std::string scene_layers(const RigScene& scene, const std::string& columns) {
  std::string layers;
  const auto add = [&](bool any, const std::string& layer) {
    if (any) layers += (layers.empty() ? "" : ", ") + layer;
  };
  add(!scene.boards.empty(),
      fmt::format("$boards using {} with lines lw 0.7 lc rgb '#999999' title 'boards'", columns));
  add(!scene.cameras.empty(),
      fmt::format("$cameras using {} with lines lw 1.3 lc rgb '#0072b2' title 'cameras'", columns));
  add(!scene.projectors.empty(),
      fmt::format("$projectors using {} with lines lw 1.3 lc rgb '#d55e00' title 'projectors'", columns));
  add(!scene.leds.empty(),
      fmt::format("$leds using {} with points pt 7 ps 0.4 lc rgb '#cc79a7' title 'LEDs'", columns));
  add(!scene.probes.empty(),
      fmt::format("$probes using {} with points pt 2 ps 0.5 lc rgb '#009e73' title 'probe at its stations'", columns));
  return layers;
}

// The drawn part of space: whole steps of tics, the same along all axes.
struct SceneAxes {
  double step_mm = 0;
  Eigen::Vector3d low_mm, high_mm;  // x, z and -y
};

SceneAxes axes_of(const RigScene& scene) {
  Eigen::AlignedBox3d box = bounds_mm(scene);
  const Eigen::Vector3d room = Eigen::Vector3d::Constant(0.04 * box.diagonal().norm());  // for names
  box = Eigen::AlignedBox3d(box.min() - room, box.max() + room);
  SceneAxes axes{largest_round_below(box.diagonal().maxCoeff() / 4), {}, {}};
  axes.low_mm = Eigen::Vector3d(box.min().x(), box.min().z(), -box.max().y());
  axes.high_mm = Eigen::Vector3d(box.max().x(), box.max().z(), -box.min().y());
  axes.low_mm = (axes.low_mm / axes.step_mm).array().floor() * axes.step_mm;
  axes.high_mm = (axes.high_mm / axes.step_mm).array().ceil() * axes.step_mm;
  return axes;
}

std::string axes_commands(const SceneAxes& axes) {
  return fmt::format(
      "set tics out nomirror {} textcolor rgb '#000000'\nset grid xtics ytics lw 0.3 lc rgb '#cccccc'\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset zrange [{}:{}]\n",
      axes.step_mm, axes.low_mm.x(), axes.high_mm.x(), axes.low_mm.y(), axes.high_mm.y(), axes.low_mm.z(),
      axes.high_mm.z());
}

// gnuplot's scale at which the axes' box, seen in parallel projection, fills the drawing. Its longest edge is
// kLongestEdge_px long at scale 1 in a drawing of kSpaceWidth_px x kSpaceHeight_px.
constexpr int kSpaceWidth_px = 940, kSpaceHeight_px = 560;
constexpr double kLongestEdge_px = 281;
constexpr double kTilt_deg = 68, kTurn_deg = 25;

double scale_to_fill(const SceneAxes& axes) {
  constexpr double kFreeWidth_px = 760, kFreeHeight_px = 410;
  const Eigen::Vector3d size = (axes.high_mm - axes.low_mm) / (axes.high_mm - axes.low_mm).maxCoeff();
  const double tilt = kTilt_deg * std::numbers::pi / 180, turn = kTurn_deg * std::numbers::pi / 180;
  const double across = size.x() * std::cos(turn) + size.y() * std::sin(turn);
  const double up =
      (size.x() * std::sin(turn) + size.y() * std::cos(turn)) * std::cos(tilt) + size.z() * std::sin(tilt);
  return std::min(kFreeWidth_px / across, kFreeHeight_px / up) / kLongestEdge_px;
}

// `place`: of a point x, y, z of the scene in gnuplot's coordinates.
std::string sensor_labels(const RigScene& scene, const std::function<std::string(const Eigen::Vector3d&)>& place) {
  std::string labels;
  for (const auto& [centre, name] : scene.names) {
    labels += fmt::format("set label {} at {} right offset -0.6,-0.3 font ',10'\n", gnuplot_text(name), place(centre));
  }
  return labels;
}

}  // namespace

Plot rig_plot(const CalibrationState& state) {
  const RigScene scene = scene_of(state);
  const SceneAxes axes = axes_of(scene);
  const auto place = [](const Eigen::Vector3d& p) { return fmt::format("{:.6g},{:.6g},{:.6g}", p.x(), p.z(), -p.y()); };
  return {kSpaceWidth_px, kSpaceHeight_px,
          scene_data(scene) + sensor_labels(scene, place) + axes_commands(axes) +
              fmt::format("set view {},{},{:.4f}\n", kTilt_deg, kTurn_deg, scale_to_fill(axes)) +
              "set view equal xyz\nset xyplane relative 0\nset border 31 lw 0.5 lc rgb '#777777'\n"
              "set xlabel 'x (mm)' rotate parallel\nset ylabel 'z (mm)' rotate parallel offset 2,-1\n"
              "set zlabel '-y (mm)' rotate parallel\nset key at screen 0.99,0.98 samplen 1.5\nsplot " +
              scene_layers(scene, "1:2:3") + "\n"};
}

Plot rig_plan(const CalibrationState& state) {
  constexpr double kLeft = 70, kRight = 20, kTop = 12, kBottom = 52, kHighest = 640;
  const RigScene scene = scene_of(state);
  const SceneAxes axes = axes_of(scene);
  const Eigen::Vector3d size = axes.high_mm - axes.low_mm;
  double across = kSpaceWidth_px - kLeft - kRight, down = across * size.x() / size.y();
  if (down > kHighest) {
    across *= kHighest / down;
    down = kHighest;
  }
  const double height = down + kTop + kBottom;
  const auto place = [](const Eigen::Vector3d& p) { return fmt::format("{:.6g},{:.6g}", p.z(), p.x()); };
  return {kSpaceWidth_px, static_cast<int>(std::lround(height)),
          scene_data(scene) + sensor_labels(scene, place) + axes_commands(axes) +
              fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\nset lmargin at screen {:.5f}\n"
                          "set rmargin at screen {:.5f}\nset bmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n",
                          axes.low_mm.y(), axes.high_mm.y(), axes.high_mm.x(), axes.low_mm.x(), kLeft / kSpaceWidth_px,
                          (kLeft + across) / kSpaceWidth_px, kBottom / height, 1 - kTop / height) +
              "set border 3 lw 0.8\nset xlabel 'z (mm)' offset 0,0.6\nset ylabel 'x (mm)' offset 1\nunset key\nplot " +
              scene_layers(scene, "2:1") + "\n"};
}

}  // namespace crumple
