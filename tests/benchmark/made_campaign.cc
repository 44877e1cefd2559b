#include "tests/benchmark/made_campaign.h"

#include <random>

namespace crumple {
namespace {

constexpr ImageSize kSize{4000, 2200};
constexpr double kBoardSide_mm = 900;

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  double uniform() { return uniform_(generator_); }  // -1 to 1
  double normal(double sigma) { return sigma * normal_(generator_); }
  Eigen::Vector3d normal3(double sigma) {
    const double x = normal(sigma), y = normal(sigma);
    return {x, y, normal(sigma)};
  }

 private:
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  std::normal_distribution<double> normal_;
};

// The distortion of a real wide-angle lens; near zero the rational terms would trade places even more.
Lens true_lens(const std::string& model, double distortion) {
  std::vector<double> parameters{1761.2, 1761.3,  1999.5, 1099.5, 0.479,  0.0267,
                                 4.4e-5, -1.2e-5, 9e-5,   0.767,  0.0963, 0.0014};
  if (model == "LENSMODEL_OPENCV5")
    parameters = {1761.2, 1761.3, 1999.5, 1099.5, -0.0126, 0.0352, -4e-4, -2e-4, 0.0057};
  for (std::size_t i = 4; i < parameters.size(); ++i) parameters[i] *= distortion;
  return Lens::create(model, kSize, parameters).value();
}

Pose random_placement(int cameras, Random& random) {
  const Eigen::Vector3d turn(0.52 * random.uniform(), 0.52 * random.uniform(), 0.35 * random.uniform());
  Pose pose;
  pose.rotation = rotation_from_vector(turn);
  const double half_mm = kBoardSide_mm / 2;
  // All over the field of view, up to its edges: see() refuses what lies outside.
  const double middle_mm = 200.0 * (cameras - 1), far_mm = (cameras > 1 ? 4000 : 2500) * (1 + 0.4 * random.uniform());
  const Eigen::Vector3d centre(middle_mm + 1.1 * far_mm * random.uniform(), 0.6 * far_mm * random.uniform(), far_mm);
  pose.translation = centre - pose.rotation * Eigen::Vector3d(half_mm, half_mm, 0);
  return pose;
}

// False where a corner falls outside the image.
bool see(const CalibrationState& state, std::size_t camera, std::size_t placement, CornerView& view) {
  const Sensor& sensor = state.rig.sensors[camera];
  const Pose sensor_from_board = sensor.sensor_from_mount * state.world_from_board[placement];
  view = {camera, placement, {}, {}};
  for (int i = 0; i < state.boards[0].point_count(); ++i) {
    const auto projected = sensor.lens.project(sensor_from_board * state.boards[0].point(i));
    const Eigen::Vector2d pixel = projected.value_or(Eigen::Vector2d(-1, -1));
    if ((pixel.array() < 0).any() || pixel.x() > kSize.width_px - 1 || pixel.y() > kSize.height_px - 1) return false;
    view.corners.push_back(i);
    view.pixels.push_back(pixel);
  }
  return true;
}

void place_boards(const CampaignOptions& options, CalibrationState& truth, Observations& observations, Random& random) {
  while (observations.placement_count < static_cast<std::size_t>(options.boards)) {
    truth.world_from_board.push_back(random_placement(options.cameras, random));
    truth.board_of.push_back(0);
    std::vector<CornerView> views(truth.rig.sensors.size());
    bool whole = true;
    for (std::size_t c = 0; whole && c < views.size(); ++c) {
      whole = see(truth, c, observations.placement_count, views[c]);
    }
    if (!whole) {
      truth.world_from_board.pop_back();
      truth.board_of.pop_back();
      continue;
    }
    for (CornerView& view : views) {
      for (Eigen::Vector2d& pixel : view.pixels) {
        const double x = random.normal(options.sigma_px);
        pixel += Eigen::Vector2d(x, random.normal(options.sigma_px));
      }
      observations.corners.push_back(std::move(view));
    }
    ++observations.placement_count;
  }
}

void disturb(CalibrationState& state, Random& random) {
  const auto shift = [&](Pose& pose, double turn_rad, double shift_mm) {
    Vector6d step;
    step << random.normal3(turn_rad), random.normal3(shift_mm);
    pose = retract(pose, step);
  };
  state.boards[0].warp_mm.setZero();
  for (std::size_t c = 0; c < state.rig.sensors.size(); ++c) {
    Sensor& sensor = state.rig.sensors[c];
    std::vector<double> parameters = sensor.lens.parameters();
    parameters[0] *= 1.02;
    parameters[1] *= 1.02;
    std::fill(parameters.begin() + 4, parameters.end(), 0);
    sensor.lens = sensor.lens.with_parameters(parameters);
    if (c > 0) shift(sensor.sensor_from_mount, 1e-3, 1);
  }
  for (Pose& pose : state.world_from_board) shift(pose, 1e-2, 10);
}

}  // namespace

Campaign make_campaign(const CampaignOptions& options) {
  Random random(options.seed);
  CalibrationState truth;
  truth.boards = {Board::grid(options.corners, options.corners, kBoardSide_mm / (options.corners - 1))};
  if (options.warped) truth.boards[0].warp_mm << 2, -1;
  for (int c = 0; c < options.cameras; ++c) {
    const Pose from_probe =
        retract({}, (Vector6d() << 0.01 * c, 0.03 * c, -0.01 * c, -400.0 * c, 20.0 * c, 10.0 * c).finished());
    truth.rig.sensors.push_back(
        {"cam" + std::to_string(c), SensorKind::camera, true_lens(options.model, options.distortion), from_probe});
  }
  Campaign campaign;
  place_boards(options, truth, campaign.observations, random);
  campaign.start = truth;
  disturb(campaign.start, random);
  return campaign;
}

}  // namespace crumple
