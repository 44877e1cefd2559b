#include "tests/solvers/synthetic.h"

#include "solvers/transfer.h"

namespace crumple {
namespace {

constexpr ImageSize kMadeSize{1024, 768};

Lens lens(const char* model, double f, Eigen::Vector2d c, double k1) {
  Lens undistorted = Lens::undistorted(model, kMadeSize, f, f * 1.003, c).value();
  std::vector<double> parameters = undistorted.parameters();
  if (parameters.size() > 5) {
    parameters[4] = k1;
    parameters[5] = -0.4 * k1;
    parameters[6] = 4e-4;
    parameters[7] = -3e-4;
  }
  return undistorted.with_parameters(parameters);
}

// Tilts and shifts that spread over the field; the board's centre stays near the optical axis at 800 mm.
Pose placement(int i, const Board& board) {
  const double angle = 2.4 * i;
  const double tilt = i == 0 ? 0 : 0.35 + 0.05 * (i % 3);
  const Eigen::Vector3d centre = 0.5 * board.point(board.point_count() - 1);
  Pose pose;
  pose.rotation = rotation_from_vector(tilt * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.3 * (i % 2)));
  const Eigen::Vector3d at(50 * std::cos(1.7 * i), 35 * std::sin(1.3 * i), 800 + 40 * (i % 4));
  pose.translation = at - pose.rotation * centre;
  return pose;
}

}  // namespace

Synthetic make_synthetic(const SyntheticOptions& options) {
  std::mt19937_64 generator(options.seed);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma) { return sigma > 0 ? sigma * normal(generator) : 0.0; };
  const auto noise2 = [&](double sigma) {
    const double x = noise(sigma);
    return Eigen::Vector2d(x, noise(sigma));
  };

  Synthetic made;
  CalibrationState& truth = made.truth;
  truth.boards = {Board::grid(9, 7, 40, options.disc_radius_mm)};
  truth.boards[0].warp_mm = options.warp_mm;
  truth.rig.sensors.push_back({"cam0", SensorKind::camera, lens(options.model, 1400, {515, 380}, -0.12), {}});
  const Pose proj_from_cam = retract({}, (Vector6d() << 0.02, -0.28, 0.01, -230, -5, 30).finished());
  truth.rig.sensors.push_back({"proj0", SensorKind::projector,
                               lens(options.model, 1500, options.projector_principal_point, -0.03), proj_from_cam});
  made.observations.placement_count = static_cast<std::size_t>(options.placements);
  for (int p = 0; p < options.placements; ++p) {
    truth.world_from_board.push_back(placement(p, truth.boards[0]));
    truth.board_of.push_back(0);
    const std::size_t index = static_cast<std::size_t>(p);
    CornerView corners{0, index, {}, {}};
    for (int i = 0; i < truth.boards[0].point_count(); ++i) {
      corners.corners.push_back(i);
      const Eigen::Vector3d in_camera = truth.world_from_board.back() * truth.boards[0].point(i);
      corners.pixels.push_back(*truth.rig.sensors[0].lens.project(in_camera) + noise2(options.corner_sigma_px));
    }
    const Transfer to_projector(truth, 0, 1, index);
    StripeView columns{0, 1, index, {1, 0}, {}, {}}, rows{0, 1, index, {0, 1}, {}, {}};
    FeatureView features{1, 0, index, {}, {}};
    for (const Eigen::Vector2d& corner : corners.pixels) {
      const Eigen::Vector2d camera_pixel = corner.array().round();
      const Eigen::Vector2d projector_pixel = to_projector(camera_pixel).value();
      for (StripeView* view : {&columns, &rows}) {
        view->camera_pixels.push_back(camera_pixel);
        view->coordinates_px.push_back(view->normal.dot(projector_pixel) + noise(options.stripe_sigma_px));
      }
      features.projector_pixels.push_back(projector_pixel);
      features.camera_pixels.push_back(camera_pixel + noise2(options.feature_sigma_px));
    }
    made.observations.corners.push_back(corners);
    made.observations.stripes.push_back(columns);
    made.observations.stripes.push_back(rows);
    made.observations.features.push_back(features);
  }
  return made;
}

CalibrationState disturbed(const CalibrationState& truth, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  CalibrationState state = truth;
  state.boards[0].warp_mm.setZero();
  const auto disturb = [&](Pose& pose) {
    Vector6d step;
    for (int i = 0; i < 6; ++i) step[i] = uniform(generator) * (i < 3 ? 0.02 : 8);
    pose = retract(pose, step);
  };
  for (Sensor& sensor : state.rig.sensors) {
    std::vector<double> p = sensor.lens.parameters();
    for (std::size_t i = 0; i < 4; ++i) p[i] += 15 * uniform(generator);
    for (std::size_t i = 4; i < p.size(); ++i) p[i] = 0;
    sensor.lens = sensor.lens.with_parameters(p);
  }
  disturb(state.rig.sensors[1].sensor_from_mount);
  for (Pose& pose : state.world_from_board) disturb(pose);
  return state;
}

}  // namespace crumple
