#include "calib/initial_rig.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <random>

#include <fmt/format.h>

#include "solvers/closed_form/board_pose.h"
#include "solvers/closed_form/homography.h"
#include "solvers/closed_form/radial_alignment.h"
#include "solvers/closed_form/resection.h"
#include "solvers/closed_form/zhang.h"
#include "solvers/decompositions.h"
#include "solvers/mean_pose.h"
#include "tracking/median.h"

namespace crumple {
namespace {

constexpr std::size_t kMinimumPlacements = 3;
// Of a projector's start.
constexpr std::size_t kViewsOfADraw = 3;
constexpr int kDraws = 60;
constexpr double kInStep =
    0.05;  // of the panel's width; lenses bend less, whole stripes that are wrong are off by more

struct CameraStart {
  Lens lens;
  std::map<std::size_t, Pose> sensor_from_board;  // by placement
};

Points2d board_points(const Board& board, const CornerView& view) {
  Points2d points;
  for (const int corner : view.corners) points.push_back(board.point(corner).head<2>());
  return points;
}

using Homographies = std::map<std::size_t, Eigen::Matrix3d>;  // by placement

// What one camera sees.
struct CameraViews {
  const SensorSpec& spec;
  std::vector<const CornerView*> views;
  std::vector<PlaneView> points;  // of the same views
  Homographies homographies;

  Eigen::Vector2d middle() const { return {0.5 * (spec.size.width_px - 1), 0.5 * (spec.size.height_px - 1)}; }
};

// Per corner; infinite where one has no projection.
double reprojection_rms(const CameraStart& start, const CameraViews& camera) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t v = 0; v < camera.views.size(); ++v) {
    const Pose& pose = start.sensor_from_board.at(camera.views[v]->placement);
    for (std::size_t i = 0; i < camera.points[v].pixels.size(); ++i, ++count) {
      const Eigen::Vector2d& p = camera.points[v].plane_mm[i];
      const auto pixel = start.lens.project(pose * Eigen::Vector3d(p.x(), p.y(), 0));
      if (!pixel) return std::numeric_limits<double>::infinity();
      sum += (*pixel - camera.points[v].pixels[i]).squaredNorm();
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

Expected<Lens> lens_from(const std::string& model, ImageSize size, const PinholeIntrinsics& intrinsics) {
  return Lens::undistorted(model, size, intrinsics.focal_x_px, intrinsics.focal_y_px, intrinsics.principal_point_px);
}

std::optional<CameraStart> pinhole_start(const CameraViews& camera, const PinholeIntrinsics& intrinsics) {
  auto lens = lens_from(camera.spec.lens_model, camera.spec.size, intrinsics);
  if (!lens) return std::nullopt;
  CameraStart start{std::move(*lens), {}};
  for (const auto& [placement, h] : camera.homographies) {
    start.sensor_from_board[placement] = plane_pose(h, intrinsics.matrix());
  }
  return start;
}

using Poses = std::vector<std::optional<Pose>>;

// A radial distortion that is linear in its terms once the poses are known: for a slope q of length r and the pixel u
// about the middle, u (1 + k4 r^2 + ...) = f q (1 + k1 r^2 + ...).
struct RadialForm {
  std::vector<std::size_t> numerator;    // which of k1 k2 k3 among the lens's parameters
  std::vector<std::size_t> denominator;  // of k4 k5 k6
};

std::vector<RadialForm> radial_forms(const std::string& model) {
  std::vector<RadialForm> forms = {{}};
  if (model.rfind("LENSMODEL_OPENCV", 0) != 0) return forms;
  forms.push_back({{4}, {}});
  forms.push_back({{4, 5}, {}});
  if (model == "LENSMODEL_OPENCV4") return forms;
  forms.push_back({{4, 5, 8}, {}});
  if (model == "LENSMODEL_OPENCV5") return forms;
  // As many below as above: these do not fold far out.
  forms.push_back({{4}, {9}});
  forms.push_back({{4, 5}, {9, 10}});
  forms.push_back({{4, 5, 8}, {9, 10, 11}});
  return forms;
}

// With one focal length about the image's middle.
std::optional<Lens> fit_lens(const CameraViews& camera, const Poses& poses, const RadialForm& form) {
  const auto unit = Lens::undistorted(camera.spec.lens_model, camera.spec.size, 1, 1, Eigen::Vector2d::Zero());
  if (!unit) return std::nullopt;
  const auto above = static_cast<Eigen::Index>(form.numerator.size());
  const auto below = static_cast<Eigen::Index>(form.denominator.size());
  const Eigen::Index count = 1 + above + below;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (std::size_t v = 0; v < poses.size(); ++v) {
    if (!poses[v]) continue;
    for (std::size_t i = 0; i < camera.points[v].pixels.size(); ++i) {
      const Eigen::Vector2d& p = camera.points[v].plane_mm[i];
      const auto slope = unit->project(*poses[v] * Eigen::Vector3d(p.x(), p.y(), 0));
      if (!slope) continue;
      const Eigen::Vector2d u = camera.points[v].pixels[i] - camera.middle();
      const double square = slope->squaredNorm();
      Eigen::Matrix2Xd row(2, count);
      for (Eigen::Index k = 0; k <= above; ++k) row.col(k) = std::pow(square, k) * *slope;
      for (Eigen::Index k = 1; k <= below; ++k) row.col(above + k) = -std::pow(square, k) * u;
      // About what the denominator multiplies a pixel's error by.
      const double weight = std::pow(1 + square, -2 * below);
      normal += weight * row.transpose() * row;
      right += weight * row.transpose() * u;
    }
  }
  const Eigen::VectorXd solution = solve_symmetric(normal, right);
  const double focal = solution[0];
  auto lens = Lens::undistorted(camera.spec.lens_model, camera.spec.size, focal, focal, camera.middle());
  if (!lens || !solution.allFinite()) return std::nullopt;
  std::vector<double> parameters = lens->parameters();
  for (Eigen::Index k = 1; k <= above; ++k) {
    parameters[form.numerator[static_cast<std::size_t>(k - 1)]] = solution[k] / focal;
  }
  for (Eigen::Index k = 1; k <= below; ++k) {
    parameters[form.denominator[static_cast<std::size_t>(k - 1)]] = solution[above + k];
  }
  return lens->with_parameters(parameters);
}

std::optional<CameraStart> radial_start(const CameraViews& camera, const Poses& poses, const RadialForm& form) {
  auto lens = fit_lens(camera, poses, form);
  if (!lens) return std::nullopt;
  CameraStart start{std::move(*lens), {}};
  for (std::size_t v = 0; v < poses.size(); ++v) {
    const PlaneView& points = camera.points[v];
    const auto pose = poses[v] ? poses[v] : board_pose(start.lens, points.plane_mm, points.pixels);
    if (!pose) return std::nullopt;
    start.sensor_from_board[camera.views[v]->placement] = *pose;
  }
  return start;
}

Expected<CameraViews> views_of(const SensorSpec& spec, std::size_t sensor, const CalibrationState& state,
                               const std::vector<CornerView>& corners,
                               const std::vector<std::string>& placement_names) {
  CameraViews camera{spec, {}, {}, {}};
  for (const CornerView& view : corners) {
    if (view.sensor != sensor) continue;
    camera.views.push_back(&view);
    camera.points.push_back({board_points(state.board_at(view.placement), view), view.pixels});
    const auto h = homography(camera.points.back().plane_mm, view.pixels);
    if (!h) {
      return fail(fmt::format("{}, station {}: {}", spec.name, placement_names[view.placement], h.error().message));
    }
    camera.homographies[view.placement] = *h;
  }
  return camera;
}

// Zhang's six unknowns; one focal length with the principal point in the image's middle; or that and radial
// distortion: whichever reprojects best. Discs are taken at their image's centre of gravity: the start can bear it.
Expected<CameraStart> start_camera(const SensorSpec& spec, std::size_t sensor, const CalibrationState& state,
                                   const std::vector<CornerView>& corners,
                                   const std::vector<std::string>& placement_names) {
  const auto camera = views_of(spec, sensor, state, corners, placement_names);
  if (!camera) return tl::unexpected(camera.error());
  if (camera->homographies.size() < kMinimumPlacements) {
    return fail(fmt::format("{} sees the board in {} placements: a calibration needs at least {}", spec.name,
                            camera->homographies.size(), kMinimumPlacements));
  }
  std::vector<Eigen::Matrix3d> list;
  for (const auto& [placement, h] : camera->homographies) list.push_back(h);
  const auto zhang = zhang_intrinsics(list);
  std::vector<std::optional<CameraStart>> starts;
  if (zhang) starts.push_back(pinhole_start(*camera, *zhang));
  if (!planes_are_parallel(list)) {
    if (const auto centred = intrinsics_about(camera->middle(), list)) {
      starts.push_back(pinhole_start(*camera, *centred));
    }
    if (const auto poses = align_radially(camera->middle(), camera->points)) {
      for (const RadialForm& form : radial_forms(spec.lens_model)) {
        starts.push_back(radial_start(*camera, *poses, form));
      }
    }
  }
  if (!zhang && spec.assumed_focal_px) {
    const double focal_px = *spec.assumed_focal_px;
    starts.push_back(pinhole_start(*camera, {focal_px, focal_px, camera->middle()}));
  }
  const CameraStart* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& start : starts) {
    const double rms = start ? reprojection_rms(*start, *camera) : least;
    if (!(rms < least)) continue;
    least = rms;
    best = &*start;
  }
  if (best == nullptr && !zhang) return fail(fmt::format("{}: {}", spec.name, zhang.error().message));
  if (best == nullptr) return fail(fmt::format("{}: no pose of the board explains its corners", spec.name));
  return *best;
}

// Gives a board pose to every placement that a joined camera sees.
void pose_placements(const std::map<std::size_t, CameraStart>& starts, std::size_t sensor,
                     const Pose& sensor_from_probe, std::map<std::size_t, Pose>& probe_from_board) {
  for (const auto& [placement, sensor_from_board] : starts.at(sensor).sensor_from_board) {
    probe_from_board.try_emplace(placement, sensor_from_probe.inverse() * sensor_from_board);
  }
}

// sensor_from_probe from the placements a camera shares with those already posed; nothing where there are none.
std::optional<Pose> join(const CameraStart& start, const std::map<std::size_t, Pose>& probe_from_board) {
  std::vector<Pose> candidates;
  for (const auto& [placement, sensor_from_board] : start.sensor_from_board) {
    const auto known = probe_from_board.find(placement);
    if (known != probe_from_board.end()) candidates.push_back(sensor_from_board * known->second.inverse());
  }
  if (candidates.empty()) return std::nullopt;
  return mean_pose(candidates);
}

struct ProjectorPoints {
  std::vector<Eigen::Vector3d> in_probe;
  Points2d pixels;
  std::vector<Eigen::Matrix3d> pixel_from_board;  // one per placement
  std::vector<Pose> probe_from_board;             // of the same placements
};

// Where the ray of a camera pixel meets the plane z = 0 of the board, in board coordinates.
std::optional<Eigen::Vector3d> on_board(const Sensor& camera, const Pose& probe_from_board,
                                        const Eigen::Vector2d& pixel) {
  const auto ray = camera.lens.ray(pixel);
  if (!ray) return std::nullopt;
  const Pose board_from_camera = (camera.sensor_from_mount * probe_from_board).inverse();
  const Eigen::Vector3d direction = board_from_camera.rotation * *ray;
  if (std::abs(direction.z()) < 1e-6) return std::nullopt;
  return board_from_camera.translation - board_from_camera.translation.z() / direction.z() * direction;
}

ProjectorPoints projector_points(const PixelPairs& view, const CalibrationState& state) {
  ProjectorPoints points;
  Points2d plane, pixels;
  const Pose& probe_from_board = state.world_from_board[view.placement];
  for (std::size_t i = 0; i < view.camera_pixels.size(); ++i) {
    const auto point = on_board(state.rig.sensors[view.camera], probe_from_board, view.camera_pixels[i]);
    if (!point) continue;
    plane.emplace_back(point->head<2>());
    pixels.push_back(view.projector_pixels[i]);
    points.in_probe.push_back(probe_from_board * *point);
    points.pixels.push_back(view.projector_pixels[i]);
  }
  if (const auto h = homography(plane, pixels)) {
    points.pixel_from_board.push_back(*h);
    points.probe_from_board.push_back(probe_from_board);
  }
  return points;
}

template <typename T>
void append(const std::vector<T>& more, std::vector<T>& to) {
  to.insert(to.end(), more.begin(), more.end());
}

ProjectorPoints together(const std::vector<ProjectorPoints>& views, const std::vector<std::size_t>& chosen) {
  ProjectorPoints all;
  for (const std::size_t v : chosen) {
    append(views[v].in_probe, all.in_probe);
    append(views[v].pixels, all.pixels);
    append(views[v].pixel_from_board, all.pixel_from_board);
    append(views[v].probe_from_board, all.probe_from_board);
  }
  return all;
}

std::optional<Resection> projector_by_zhang(const ProjectorPoints& points) {
  const auto intrinsics = zhang_intrinsics(points.pixel_from_board);
  if (!intrinsics) return std::nullopt;
  std::vector<Pose> mounts;
  for (std::size_t i = 0; i < points.pixel_from_board.size(); ++i) {
    mounts.push_back(plane_pose(points.pixel_from_board[i], intrinsics->matrix()) *
                     points.probe_from_board[i].inverse());
  }
  return Resection{*intrinsics, mean_pose(mounts)};
}

double reprojection_rms(const Resection& start, const ProjectorPoints& points) {
  double sum = 0;
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    const Eigen::Vector3d in_sensor = start.sensor_from_points * points.in_probe[i];
    if (in_sensor.z() <= 0) return std::numeric_limits<double>::infinity();
    sum += ((start.intrinsics.matrix() * in_sensor).hnormalized() - points.pixels[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.pixels.size()));
}

Expected<Resection> start_projector(const ProjectorPoints& points) {
  const auto zhang = projector_by_zhang(points);
  const auto resection = resect(points.in_probe, points.pixels);
  if (!zhang && !resection) return tl::unexpected(resection.error());
  if (!resection) return *zhang;
  if (!zhang) return *resection;
  return reprojection_rms(*resection, points) <= reprojection_rms(*zhang, points) ? *resection : *zhang;
}

double median_error_px(const Resection& start, const ProjectorPoints& points) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    const Eigen::Vector3d in_sensor = start.sensor_from_points * points.in_probe[i];
    if (in_sensor.z() <= 0) return std::numeric_limits<double>::infinity();
    errors.push_back(((start.intrinsics.matrix() * in_sensor).hnormalized() - points.pixels[i]).norm());
  }
  return errors.empty() ? 0 : median_of(std::move(errors));
}

std::vector<std::size_t> views_that_follow(const Resection& start, const std::vector<ProjectorPoints>& views,
                                           double tolerance_px) {
  std::vector<std::size_t> following;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (median_error_px(start, views[v]) <= tolerance_px) following.push_back(v);
  }
  return following;
}

// All views, but where they contradict each other the most that agree: at a station whose patterns were taken out of
// step with the projector every pixel has a wrong coordinate, and one such view spoils the closed forms. Starts from
// three views at a time, drawn with a fixed seed; a minority is not believed.
std::vector<std::size_t> views_in_step(const std::vector<ProjectorPoints>& views, double tolerance_px) {
  std::vector<std::size_t> all(views.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto of_all = start_projector(together(views, all));
  if (views.size() <= kViewsOfADraw || (of_all && views_that_follow(*of_all, views, tolerance_px).size() == all.size()))
    return all;
  std::mt19937 random(1);
  std::vector<std::size_t> best;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<std::size_t> some;
    std::sample(all.begin(), all.end(), std::back_inserter(some), kViewsOfADraw, random);
    const auto start = start_projector(together(views, some));
    if (!start) continue;
    std::vector<std::size_t> following = views_that_follow(*start, views, tolerance_px);
    if (following.size() > best.size()) best = std::move(following);
  }
  return 2 * best.size() > all.size() ? best : all;
}

}  // namespace

Expected<CalibrationState> initial_cameras(const std::vector<SensorSpec>& sensors, const std::vector<Board>& boards,
                                           const std::vector<std::size_t>& board_of,
                                           const std::vector<CornerView>& corners,
                                           const std::vector<std::string>& placement_names) {
  CalibrationState state;
  state.boards = boards;
  state.world_from_board.resize(placement_names.size());
  state.board_of = board_of;
  std::map<std::size_t, CameraStart> starts;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    const SensorSpec& spec = sensors[s];
    if (spec.kind == SensorKind::camera) {
      auto start = start_camera(spec, s, state, corners, placement_names);
      if (!start) return tl::unexpected(start.error());
      state.rig.sensors.push_back({spec.name, spec.kind, start->lens, {}, spec.mount});
      starts.emplace(s, std::move(*start));
      continue;
    }
    auto lens = Lens::undistorted(spec.lens_model, spec.size, spec.size.width_px, spec.size.width_px,
                                  {0.5 * (spec.size.width_px - 1), 0.5 * (spec.size.height_px - 1)});
    if (!lens) return fail(fmt::format("{}: {}", spec.name, lens.error().message));
    state.rig.sensors.push_back({spec.name, spec.kind, std::move(*lens), {}, spec.mount});
  }
  if (starts.empty()) return fail("the capture has no camera: nothing sees the board");

  std::map<std::size_t, Pose> probe_from_board;
  std::map<std::size_t, CameraStart> waiting = starts;
  pose_placements(starts, starts.begin()->first, {}, probe_from_board);
  waiting.erase(starts.begin()->first);
  while (!waiting.empty()) {
    const auto next = std::find_if(waiting.begin(), waiting.end(),
                                   [&](const auto& entry) { return join(entry.second, probe_from_board).has_value(); });
    if (next == waiting.end()) {
      return fail(fmt::format("{} shares no board placement with the other cameras: show the board to both at once",
                              sensors[waiting.begin()->first].name));
    }
    Pose& mount = state.rig.sensors[next->first].sensor_from_mount;
    mount = *join(next->second, probe_from_board);
    pose_placements(starts, next->first, mount, probe_from_board);
    waiting.erase(next);
  }
  for (const auto& [placement, pose] : probe_from_board) state.world_from_board[placement] = pose;
  return state;
}

Expected<void> add_initial_projectors(const std::vector<PixelPairs>& pairs, CalibrationState& state) {
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    Sensor& sensor = state.rig.sensors[s];
    if (sensor.kind != SensorKind::projector) continue;
    std::vector<ProjectorPoints> views;
    for (const PixelPairs& view : pairs) {
      if (view.projector == s) views.push_back(projector_points(view, state));
    }
    const std::vector<std::size_t> chosen = views_in_step(views, kInStep * sensor.lens.size().width_px);
    const auto start = start_projector(together(views, chosen));
    if (!start) return fail(fmt::format("{}: {}", sensor.name, start.error().message));
    auto lens = lens_from(sensor.lens.model(), sensor.lens.size(), start->intrinsics);
    if (!lens) return fail(fmt::format("{}: {}", sensor.name, lens.error().message));
    sensor.lens = std::move(*lens);
    sensor.sensor_from_mount = start->sensor_from_points;
  }
  return {};
}

}  // namespace crumple
