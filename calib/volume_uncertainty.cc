#include "calib/volume_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/seen_boards.h"
#include "solvers/body_motion.h"
#include "solvers/decompositions.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

constexpr double kLeastPointInformation = 1e-10;  // eigenvalue, scaled to a unit diagonal
constexpr std::size_t kVolumeStations = 3;

struct GridPoint {
  int column = 0;
  int row = 0;
  double depth_mm = 0;
  Eigen::Vector3d in_mount;  // of the reference camera
};

std::vector<GridPoint> volume_grid(const CalibrationData& data, const CalibrationState& state, std::size_t camera) {
  const Sensor& sensor = state.rig.sensors[camera];
  const std::vector<double> depths_mm = board_depths_mm(data, state, camera);
  std::vector<GridPoint> grid;
  const std::set<double> layers_mm{depths_mm.front(), depths_mm.back()};
  for (const double depth_mm : layers_mm) {
    for (int i = 0; i < 9; ++i) {
      const int column = i % 3, row = i / 3;
      const Eigen::Vector2d pixel((column * 2 + 1) * sensor.lens.size().width_px / 6.0,
                                  (row * 2 + 1) * sensor.lens.size().height_px / 6.0);
      const auto ray = sensor.lens.ray(pixel);
      if (!ray || !(ray->z() > 0)) continue;
      grid.push_back({column, row, depth_mm, sensor.sensor_from_mount.inverse() * (depth_mm / ray->z() * *ray)});
    }
  }
  return grid;
}

// Stations at which trackers see LEDs, spread over all of them.
std::vector<std::size_t> volume_stations(const CalibrationData& data, const Rig& rig) {
  std::set<std::size_t> with_leds;
  for (const LedView& view : data.observations.leds) {
    if (view.station && rig.sensors[view.sensor].mount == Mount::world) with_leds.insert(*view.station);
  }
  const std::vector<std::size_t> all(with_leds.begin(), with_leds.end());
  std::set<std::size_t> chosen;
  for (std::size_t i = 0; i < kVolumeStations && !all.empty(); ++i) {
    chosen.insert(all[i * (all.size() - 1) / (kVolumeStations - 1)]);
  }
  return {chosen.begin(), chosen.end()};
}

// What sees a point of the mount's frame, and at a station the probe's LEDs.
struct Seen {
  CalibrationState state;  // the point is its last LED
  Observations observations;
  std::size_t sensors = 0;
};

Seen seen_point(const CalibrationData& data, const CalibrationState& state, Mount mount, const Eigen::Vector3d& point,
                std::optional<std::size_t> station) {
  Seen seen{state, {}};
  const std::size_t led = state.rig.leds.size();
  seen.state.rig.leds.push_back({"", station ? state.world_from_probe[*station] * point : point, Mount::world});
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    const Sensor& sensor = state.rig.sensors[s];
    if (sensor.mount != mount) continue;
    const auto pixel = sensor.lens.project(sensor.sensor_from_mount * point);
    if (!pixel || !in_image(sensor.lens, *pixel)) continue;
    seen.observations.leds.push_back({s, {led}, {*pixel}, station});
    ++seen.sensors;
  }
  for (const LedView& view : data.observations.leds) {
    if (station && view.station == station && state.rig.sensors[view.sensor].mount == Mount::world) {
      seen.observations.leds.push_back(view);
    }
  }
  return seen;
}

// d point / d blocks; none where the point is not determined.
std::optional<Eigen::MatrixXd> d_point(const Seen& seen, std::optional<std::size_t> station, const WeightOf& weights,
                                       std::vector<BlockId> blocks) {
  if (station) blocks.push_back({BlockId::Kind::station, *station});
  blocks.push_back({BlockId::Kind::led, seen.state.rig.leds.size() - 1});
  const auto all = information(seen.observations, seen.state, weights, blocks);
  if (!all) return std::nullopt;
  const Eigen::Index unknown = station ? 9 : 3, known = all->rows() - unknown;
  const auto inverse = inverse_information(all->bottomRightCorner(unknown, unknown), kLeastPointInformation);
  if (!inverse) return std::nullopt;
  return Eigen::MatrixXd(-inverse->bottomRows(3) * all->bottomLeftCorner(unknown, known));
}

// d pixel / d blocks of all points, the camera posed by them.
Eigen::MatrixXd d_posed_pixels(const CalibrationState& state, std::size_t camera, const std::vector<GridPoint>& grid,
                               const std::vector<BlockId>& blocks) {
  Observations observations;
  observations.leds.push_back({camera, {}, {}});
  CalibrationState with_points = state;
  const Sensor& sensor = state.rig.sensors[camera];
  for (const GridPoint& point : grid) {
    const auto pixel = sensor.lens.project(sensor.sensor_from_mount * point.in_mount);
    if (!pixel) continue;
    observations.leds[0].leds.push_back(with_points.rig.leds.size());
    observations.leds[0].pixels.push_back(*pixel);
    with_points.rig.leds.push_back({"", point.in_mount, Mount::world});
  }
  const auto views = make_views(observations, state.board_of);
  ViewEvaluation evaluation;
  views[0]->evaluate(with_points, true, evaluation);
  const Eigen::MatrixXd lens = block_jacobian(*views[0], evaluation, with_points, 0);
  const Eigen::MatrixXd pose = block_jacobian(*views[0], evaluation, with_points, 1);
  const Eigen::MatrixXd posed = lens - pose * solve_symmetric(pose.transpose() * pose, pose.transpose() * lens);
  const BlockId own{BlockId::Kind::lens, sensor.lens_of.value_or(camera)};
  Eigen::Index columns = 0;
  for (const BlockId& block : blocks) columns += tangent_size(block, state);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(posed.rows(), columns);
  columns = 0;
  for (const BlockId& block : blocks) {
    if (block == own) all.middleCols(columns, posed.cols()) = posed;
    columns += tangent_size(block, state);
  }
  return all;
}

bool uncertain(const BlockId& block, const JointCovariance& covariance, const CalibrationState& state) {
  return covariance.of({block}, state).diagonal().minCoeff() > 0;
}

// Those with a covariance, shared lenses once.
std::vector<BlockId> rig_blocks(const CalibrationData& data, const Calibration& calibration,
                                const JointCovariance& covariance) {
  const CalibrationState& state = calibration.bundle.state;
  std::vector<BlockId> blocks =
      Parameters(state, make_views(data.observations, state.board_of), {}, calibration.priors).common_blocks();
  std::erase_if(blocks, [&](const BlockId& block) { return block.is_pose() || !uncertain(block, covariance, state); });
  return blocks;
}

struct VolumeSample {
  GridPoint of;
  std::optional<std::size_t> station;
  Eigen::Vector3d position_mm;   // in the world, or in the mount's frame
  Eigen::MatrixXd d_parameters;  // 3 rows
};

// The grid's points that two sensors or more see, from each of the volume's stations.
std::vector<VolumeSample> triangulated_points(const CalibrationData& data, const Calibration& calibration,
                                              std::size_t camera, const std::vector<GridPoint>& grid,
                                              const std::vector<BlockId>& blocks) {
  const CalibrationState& state = calibration.bundle.state;
  const Mount mount = state.rig.sensors[camera].mount;
  std::vector<std::optional<std::size_t>> stations{std::nullopt};
  const auto with_leds = volume_stations(data, state.rig);
  if (mount == Mount::probe && !with_leds.empty()) stations.assign(with_leds.begin(), with_leds.end());
  const WeightOf weights = weights_of(calibration);
  std::vector<VolumeSample> points;
  for (const auto& station : stations) {
    for (const GridPoint& of : grid) {
      const Seen seen = seen_point(data, state, mount, of.in_mount, station);
      if (seen.sensors < 2) continue;
      auto derivative = d_point(seen, station, weights, blocks);
      if (!derivative) continue;
      points.push_back({of, station, seen.state.rig.leds.back().position_mm, std::move(*derivative)});
    }
  }
  return points;
}

}  // namespace

double MeasuringVolume::mean_uncertainty(const Eigen::VectorXd& variances) const {
  const Eigen::Index points = variances.size() / coordinates;
  double sum = 0;
  for (Eigen::Index p = 0; p < points; ++p) sum += std::sqrt(variances.segment(coordinates * p, coordinates).sum());
  return sum / static_cast<double>(points);
}

Expected<MeasuringVolume> measuring_volume(const CalibrationData& data, const Calibration& calibration,
                                           const std::vector<BlockId>& blocks) {
  const CalibrationState& state = calibration.bundle.state;
  const auto camera = first_board_camera(data.observations, state.rig);
  if (!camera) return fail("no camera sees a board, so there is no volume to plan for");
  const std::vector<GridPoint> grid = volume_grid(data, state, *camera);
  const auto points = triangulated_points(data, calibration, *camera, grid, blocks);
  if (points.empty()) return MeasuringVolume{false, d_posed_pixels(state, *camera, grid, blocks), 2};
  const auto rows = 3 * static_cast<Eigen::Index>(points.size());
  MeasuringVolume volume{true, Eigen::MatrixXd(rows, points[0].d_parameters.cols()), 3};
  for (std::size_t p = 0; p < points.size(); ++p) {
    volume.d_parameters.middleRows<3>(3 * static_cast<Eigen::Index>(p)) = points[p].d_parameters;
  }
  return volume;
}

Expected<VolumePoints> volume_points(const CalibrationData& data, const Calibration& calibration) {
  const CalibrationState& state = calibration.bundle.state;
  const auto camera = first_board_camera(data.observations, state.rig);
  if (!camera) return fail("no camera sees a board, so there is no measuring volume");
  const std::vector<BlockId> blocks = rig_blocks(data, calibration, whole_covariance(calibration));
  const auto points = triangulated_points(data, calibration, *camera, volume_grid(data, state, *camera), blocks);
  if (points.empty()) return fail("no two sensors see points of the measuring volume");
  const Mount frame = points[0].station ? Mount::world : state.rig.sensors[*camera].mount;
  std::vector<std::string> names;
  for (const BlockId& block : blocks) {
    const std::vector<std::string> of_block = parameter_names(block, state);
    names.insert(names.end(), of_block.begin(), of_block.end());
  }
  const RigCovariance known = rig_covariance(calibration);
  const std::vector<std::string> datum = datum_names(frame);
  if (!find_row(known, datum.front())) return fail("no body is seen whose motion the points could be held against");
  names.insert(names.end(), datum.begin(), datum.end());
  const Eigen::MatrixXd covariance = covariance_of(known, names);
  VolumePoints volume{*camera, frame, {}};
  for (const VolumeSample& point : points) {
    Eigen::MatrixXd against_bodies(3, covariance.cols());
    against_bodies << point.d_parameters, cross_matrix(point.position_mm), -Eigen::Matrix3d::Identity();
    volume.points.push_back({point.of.column, point.of.row, point.of.depth_mm, point.station,
                             against_bodies * covariance * against_bodies.transpose()});
  }
  return volume;
}

WeightOf weights_of(const Calibration& calibration) {
  return [&calibration](const View& view) {
    ViewWeights weights;
    bool of_kind = false;
    for (const GroupSummary& group : calibration.bundle.groups) {
      if (group.sensor != view.sensor() || of_kind) continue;
      of_kind = group.kind == view.kind();
      weights.sigma_px = group.sigma_px;
    }
    weights.inflation = calibration.inflation.of(view.kind());
    return weights;
  };
}

std::vector<BlockId> estimated_blocks(const CalibrationData& data, const Calibration& calibration) {
  const JointCovariance& covariance = calibration.bundle.covariance;
  std::vector<BlockId> blocks = rig_blocks(data, calibration, covariance);
  std::set<BlockId> placements;
  for (const CornerView& view : data.observations.corners) {
    if (view.station) placements.insert({BlockId::Kind::placement, view.placement});
  }
  std::erase_if(placements,
                [&](const BlockId& block) { return !uncertain(block, covariance, calibration.bundle.state); });
  blocks.insert(blocks.end(), placements.begin(), placements.end());
  return blocks;
}

}  // namespace crumple
