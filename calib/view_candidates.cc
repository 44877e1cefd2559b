#include "calib/view_candidates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "calib/seen_boards.h"
#include "solvers/sensor_chain.h"
#include "solvers/transfer.h"

namespace crumple {
namespace {

constexpr double kTurn_rad = 30 * std::numbers::pi / 180;
constexpr double kSameDistance = 1.05;
constexpr double kFacing = 0.966;  // cosine of 15 degrees
constexpr std::size_t kPlacements = 3;
constexpr int kLattice = 8;  // readings predicted along each side of a board
constexpr std::array<std::pair<double, double>, 5> kTurns_rad{
    {{0, 0}, {kTurn_rad, 0}, {-kTurn_rad, 0}, {0, kTurn_rad}, {0, -kTurn_rad}}};

// In its own frame.
struct Shown {
  Eigen::Vector3d middle;
  std::vector<Eigen::Vector3d> points;
};

Shown shown(const Board& board) {
  Shown all{board_centre(board), {}};
  for (int i = 0; i < board.point_count(); ++i) all.points.push_back(board.point(i));
  return all;
}

Shown shown(const LedView& view, const Rig& rig) {
  Shown all{Eigen::Vector3d::Zero(), {}};
  for (const std::size_t led : view.leds) {
    all.points.push_back(rig.leds[led].position_mm);
    all.middle += rig.leds[led].position_mm / static_cast<double>(view.leds.size());
  }
  return all;
}

bool sees_all(const Lens& lens, const Pose& sensor_from_shown, const Shown& shown) {
  return std::all_of(shown.points.begin(), shown.points.end(), [&](const Eigen::Vector3d& point) {
    const auto pixel = lens.project(sensor_from_shown * point);
    return pixel && in_image(lens, *pixel);
  });
}

// Which boards a camera saw, on a probe that is moved about or not.
struct Sight {
  std::size_t camera;
  std::size_t board;
  bool from_station;
  auto operator<=>(const Sight&) const = default;
};

Sight sight_of(const CornerView& view, const CalibrationState& state) {
  return {view.sensor, state.board_of[view.placement], view.station.has_value()};
}

// How boards mostly lay in the image: the turn about the camera's axis.
double usual_roll_rad(const Sight& sight, const CalibrationData& data, const CalibrationState& state) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const CornerView& view : data.observations.corners) {
    if (sight_of(view, state) != sight) continue;
    const Pose pose = sensor_from_board_pose(state, view.sensor, view.placement, view.station);
    sum += (pose.rotation * Eigen::Vector3d::UnitX()).head<2>();
  }
  return std::atan2(sum.y(), sum.x());
}

// The least, the median and the largest of ascending ones, where they are not the same.
std::vector<double> spread(const std::vector<double>& all) {
  std::vector<double> some;
  for (const double distance : {all.front(), all[all.size() / 2], all.back()}) {
    if (some.empty() || distance > kSameDistance * some.back()) some.push_back(distance);
  }
  return some;
}

// Moved inwards until all of it is seen; none where it does not fit.
std::optional<Pose> placed(const Lens& lens, const Shown& shown, const Eigen::Quaterniond& rotation, int column,
                           int row, double distance_mm) {
  const Eigen::Vector2d size(lens.size().width_px, lens.size().height_px);
  for (const double share : {1.0, 0.75, 0.5, 0.25}) {
    const Eigen::Vector2d offset = share * Eigen::Vector2d(column, row).cwiseProduct(size) / 3;
    const auto ray = lens.ray(0.5 * size + offset);
    if (!ray || !(ray->z() > 0)) continue;
    const Pose pose{rotation, distance_mm / ray->z() * *ray - rotation * shown.middle};
    if (sees_all(lens, pose, shown)) return pose;
  }
  return std::nullopt;
}

// All that say where a camera sees something, turned from how it lies or stands unturned.
std::vector<ViewCandidate> poses_before(std::size_t camera, const Lens& lens, const Shown& shown,
                                        const Eigen::Quaterniond& unturned, const std::vector<double>& depths_mm) {
  std::vector<ViewCandidate> candidates;
  for (const double distance_mm : spread(depths_mm)) {
    for (int part = 0; part < 9; ++part) {
      for (const auto& [vertical_rad, horizontal_rad] : kTurns_rad) {
        const Eigen::Quaterniond rotation = rotation_from_vector({horizontal_rad, vertical_rad, 0}) * unturned;
        ViewCandidate candidate{.camera = camera,
                                .column = part % 3 - 1,
                                .row = part / 3 - 1,
                                .distance_mm = distance_mm,
                                .about_vertical_rad = vertical_rad,
                                .about_horizontal_rad = horizontal_rad,
                                .camera_from_shown = {}};
        const auto pose = placed(lens, shown, rotation, candidate.column, candidate.row, distance_mm);
        if (!pose) continue;
        candidate.camera_from_shown = *pose;
        candidates.push_back(candidate);
      }
    }
  }
  return candidates;
}

// One for each placement before which the probe may stand; the same without any where the camera is not moved.
void add_board_candidates(const Sight& sight, const CalibrationData& data, const CalibrationState& state,
                          const std::vector<std::optional<std::size_t>>& placements,
                          std::vector<ViewCandidate>& candidates) {
  const Eigen::Quaterniond roll = rotation_from_vector(usual_roll_rad(sight, data, state) * Eigen::Vector3d::UnitZ());
  for (ViewCandidate& candidate :
       poses_before(sight.camera, state.rig.sensors[sight.camera].lens, shown(state.boards[sight.board]), roll,
                    board_depths_mm(data, state, sight.camera))) {
    candidate.board = sight.board;
    for (const auto& placement : placements) {
      candidate.placement = placement;
      candidates.push_back(candidate);
    }
  }
}

void add_led_candidates(const CalibrationData& data, const CalibrationState& state, std::size_t tracker,
                        std::vector<ViewCandidate>& candidates) {
  std::vector<const LedView*> views;
  for (const LedView& view : data.observations.leds) {
    if (view.sensor == tracker && view.station && !view.leds.empty()) views.push_back(&view);
  }
  if (views.empty()) return;
  const LedView& fullest = **std::max_element(
      views.begin(), views.end(), [](const LedView* a, const LedView* b) { return a->leds.size() < b->leds.size(); });
  const Shown probe = shown(fullest, state.rig);
  std::vector<double> depths_mm;
  for (const LedView* view : views) {
    depths_mm.push_back((sensor_from_leds(state, tracker, view->station).pose * probe.middle).z());
  }
  std::sort(depths_mm.begin(), depths_mm.end());
  const Pose as_it_stood = sensor_from_leds(state, tracker, fullest.station).pose;
  for (ViewCandidate& candidate :
       poses_before(tracker, state.rig.sensors[tracker].lens, probe, as_it_stood.rotation, depths_mm)) {
    candidate.like_station = fullest.station;
    candidates.push_back(candidate);
  }
}

// Some of the placements, the first and the last among them.
std::vector<std::optional<std::size_t>> spread(const std::set<std::size_t>& placements) {
  const std::vector<std::size_t> all(placements.begin(), placements.end());
  std::set<std::size_t> some;
  for (std::size_t i = 0; i < kPlacements; ++i) some.insert(all[i * (all.size() - 1) / (kPlacements - 1)]);
  return {some.begin(), some.end()};
}

// Directions, in the probe frame, in which each LED was seen.
std::vector<std::vector<Eigen::Vector3d>> led_directions(const CalibrationData& data, const CalibrationState& state) {
  std::vector<std::vector<Eigen::Vector3d>> directions(state.rig.leds.size());
  for (const LedView& view : data.observations.leds) {
    if (!view.station || state.rig.sensors[view.sensor].mount != Mount::world) continue;
    const Pose probe_from_sensor = sensor_from_leds(state, view.sensor, view.station).pose.inverse();
    for (const std::size_t led : view.leds) {
      directions[led].push_back((probe_from_sensor.translation - state.rig.leds[led].position_mm).normalized());
    }
  }
  return directions;
}

void add_led_views(const CalibrationData& data, std::size_t station, PredictedView& view) {
  const CalibrationState& state = view.state;
  const auto directions = led_directions(data, state);
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    if (state.rig.sensors[s].mount != Mount::world) continue;
    const Pose sensor_from_probe = sensor_from_leds(state, s, station).pose;
    LedView seen{s, {}, {}, station};
    for (std::size_t led = 0; led < state.rig.leds.size(); ++led) {
      if (state.rig.leds[led].mount != Mount::probe) continue;
      const Eigen::Vector3d& position = state.rig.leds[led].position_mm;
      const Eigen::Vector3d towards = (sensor_from_probe.inverse().translation - position).normalized();
      const bool facing = std::any_of(directions[led].begin(), directions[led].end(),
                                      [&](const Eigen::Vector3d& d) { return d.dot(towards) > kFacing; });
      const auto pixel = state.rig.sensors[s].lens.project(sensor_from_probe * position);
      if (!facing || !pixel || !in_image(state.rig.sensors[s].lens, *pixel)) continue;
      seen.leds.push_back(led);
      seen.pixels.push_back(*pixel);
    }
    if (!seen.leds.empty()) view.observations.leds.push_back(std::move(seen));
  }
}

// Points all over the board where the projector reaches.
std::pair<std::vector<Eigen::Vector2d>, std::vector<Eigen::Vector2d>> lit_pixels(const CalibrationState& state,
                                                                                 std::size_t camera,
                                                                                 std::size_t projector,
                                                                                 std::size_t placement,
                                                                                 std::optional<std::size_t> station) {
  const Board& board = state.board_at(placement);
  const Pose camera_from_board = sensor_from_board_pose(state, camera, placement, station);
  const Transfer transfer(state, camera, projector, placement, station);
  const Eigen::Vector2d centre = board_centre(board).head<2>() / board.scale;
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : board.nominal_mm()) half = half.cwiseMax((point - centre).cwiseAbs());
  std::pair<std::vector<Eigen::Vector2d>, std::vector<Eigen::Vector2d>> pixels;
  for (int i = 0; i < kLattice * kLattice; ++i) {
    const Eigen::Vector2d part(2.0 * (i % kLattice) / (kLattice - 1) - 1, 2.0 * (i / kLattice) / (kLattice - 1) - 1);
    const Eigen::Vector3d point = board.on_surface(centre + part.cwiseProduct(half));
    const auto seen = state.rig.sensors[camera].lens.project(camera_from_board * point);
    const auto lit = seen ? transfer(*seen) : std::nullopt;
    if (!lit || !in_image(state.rig.sensors[projector].lens, *lit)) continue;
    pixels.first.push_back(*seen);
    pixels.second.push_back(*lit);
  }
  return pixels;
}

template <typename V>
double mean_size(const std::vector<V>& views) {
  double sum = 0;
  for (const V& view : views) sum += static_cast<double>(view.camera_pixels.size());
  return views.empty() ? 0 : sum / static_cast<double>(views.size());
}

// Stripes and projected features, of every camera that sees the board with every projector it worked with.
void add_projected(const CalibrationData& data, const std::set<std::size_t>& cameras, std::size_t placement,
                   std::optional<std::size_t> station, PredictedView& view) {
  const auto counts = [&](const auto& of_data) {
    return cameras.contains(of_data.camera) && of_data.station.has_value() == station.has_value();
  };
  for (const StripeView& like : data.observations.stripes) {
    const auto same = [&](const StripeView& other) {
      return other.camera == like.camera && other.projector == like.projector && other.normal == like.normal;
    };
    auto& stripes = view.observations.stripes;
    if (!counts(like) || std::any_of(stripes.begin(), stripes.end(), same)) continue;
    const auto [seen, lit] = lit_pixels(view.state, like.camera, like.projector, placement, station);
    StripeView predicted{like.camera, like.projector, placement, like.normal, seen, {}, station};
    for (const Eigen::Vector2d& pixel : lit) predicted.coordinates_px.push_back(like.normal.dot(pixel));
    stripes.push_back(std::move(predicted));
  }
  for (const FeatureView& like : data.observations.features) {
    const auto same = [&](const FeatureView& other) {
      return other.camera == like.camera && other.projector == like.projector;
    };
    auto& features = view.observations.features;
    if (!counts(like) || std::any_of(features.begin(), features.end(), same)) continue;
    const auto [seen, lit] = lit_pixels(view.state, like.camera, like.projector, placement, station);
    features.push_back({like.projector, like.camera, placement, lit, seen, station});
  }
  view.readings_each = mean_size(data.observations.stripes) / (kLattice * kLattice);
  view.features_each = mean_size(data.observations.features) / (kLattice * kLattice);
}

}  // namespace

std::vector<ViewCandidate> view_candidates(const CalibrationData& data, const Calibration& calibration) {
  const CalibrationState& state = calibration.bundle.state;
  std::map<Sight, std::set<std::size_t>> sights;  // and the placements
  for (const CornerView& view : data.observations.corners) {
    sights[sight_of(view, state)].insert(view.placement);
  }
  std::vector<ViewCandidate> candidates;
  for (const auto& [sight, seen] : sights) {
    std::vector<std::optional<std::size_t>> placements{std::nullopt};
    if (sight.from_station) placements = spread(seen);
    add_board_candidates(sight, data, state, placements, candidates);
  }
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    if (state.rig.sensors[s].mount == Mount::world) add_led_candidates(data, state, s, candidates);
  }
  return candidates;
}

PredictedView predicted_view(const ViewCandidate& candidate, const CalibrationData& data,
                             const Calibration& calibration) {
  PredictedView view{calibration.bundle.state, {}, {}};
  CalibrationState& state = view.state;
  const Pose mount_from_shown =
      state.rig.sensors[candidate.camera].sensor_from_mount.inverse() * candidate.camera_from_shown;
  std::size_t placement = state.world_from_board.size();
  std::optional<std::size_t> station;
  if (!candidate.board) {
    station = state.world_from_probe.size();
    state.world_from_probe.push_back(mount_from_shown);
    view.pose = {BlockId::Kind::station, *station};
    view.observations.placement_count = placement;
    add_led_views(data, *station, view);
    return view;
  }
  if (candidate.placement) {
    placement = *candidate.placement;
    station = state.world_from_probe.size();
    state.world_from_probe.push_back(state.world_from_board[placement] * mount_from_shown.inverse());
    view.pose = {BlockId::Kind::station, *station};
    add_led_views(data, *station, view);
  } else {
    state.world_from_board.push_back(mount_from_shown);
    state.board_of.push_back(*candidate.board);
    view.pose = {BlockId::Kind::placement, placement};
  }
  view.observations.placement_count = state.world_from_board.size();

  const Shown points = shown(state.boards[*candidate.board]);
  std::set<std::size_t> cameras;
  for (const CornerView& like : data.observations.corners) {
    const Sight sight = sight_of(like, state);
    if (sight.board != *candidate.board || sight.from_station != station.has_value()) continue;
    const Pose sensor_from_board = sensor_from_board_pose(state, like.sensor, placement, station);
    if (cameras.contains(like.sensor) || !sees_all(state.rig.sensors[like.sensor].lens, sensor_from_board, points)) {
      continue;
    }
    cameras.insert(like.sensor);
    CornerView corners{like.sensor, placement, {}, {}, station};
    for (const Eigen::Vector3d& point : points.points) {
      corners.corners.push_back(static_cast<int>(corners.corners.size()));
      corners.pixels.push_back(*state.rig.sensors[like.sensor].lens.project(sensor_from_board * point));
    }
    view.observations.corners.push_back(std::move(corners));
  }
  add_projected(data, cameras, placement, station, view);
  return view;
}

}  // namespace crumple
