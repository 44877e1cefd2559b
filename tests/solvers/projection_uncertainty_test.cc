#include "solvers/projection_uncertainty.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "solvers/closed_form/rigid_fit.h"
#include "solvers/parameters.h"
#include "tests/benchmark/made_campaign.h"
#include "tests/benchmark/mrcal_peer.h"
#include "tests/python.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/made_system.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The rigid motion that carries each body seen in the frame of a mount from its place in one state to that in another.
using BodyMotions = std::function<std::vector<Pose>(const CalibrationState& from, const CalibrationState& to)>;

std::vector<Pose> of_placements(const CalibrationState& from, const CalibrationState& to) {
  std::vector<Pose> motions;
  for (std::size_t p = 0; p < from.world_from_board.size(); ++p) {
    motions.push_back(to.world_from_board[p] * from.world_from_board[p].inverse());
  }
  return motions;
}

// Where `to` projects a point that stands at a given place of a sensor's frame in `from`.
Eigen::Vector2d pixel_of_fixed(const CalibrationState& from, const CalibrationState& to, std::size_t sensor,
                               const Eigen::Vector3d& point, const BodyMotions& motions) {
  const Eigen::Vector3d in_mount = from.rig.sensors[sensor].sensor_from_mount.inverse() * point;
  const std::vector<Pose> all = motions(from, to);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Pose& motion : all) mean += motion * in_mount / static_cast<double>(all.size());
  return to.rig.sensors[sensor].lens.project(to.rig.sensors[sensor].sensor_from_mount * mean).value();
}

// The covariance of that pixel from central differences by every block there is.
Eigen::Matrix2d by_differences(const BundleResult& result, std::size_t sensor, const Eigen::Vector3d& point,
                               const BodyMotions& motions) {
  const CalibrationState& state = result.state;
  std::vector<BlockId> blocks;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    blocks.push_back({BlockId::Kind::lens, s});
    blocks.push_back({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) blocks.push_back({BlockId::Kind::led, l});
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) blocks.push_back({BlockId::Kind::placement, p});
  for (std::size_t s = 0; s < state.world_from_probe.size(); ++s) blocks.push_back({BlockId::Kind::station, s});
  std::vector<Eigen::MatrixXd> jacobians;
  Eigen::Index size = 0;
  for (const BlockId& block : blocks) {
    const auto pixel = [&](const Eigen::VectorXd& step) {
      CalibrationState to = state;
      move_block(block, step, to);
      return pixel_of_fixed(state, to, sensor, point, motions);
    };
    jacobians.push_back(central_differences(pixel, Eigen::VectorXd::Zero(tangent_size(block, state)), 1e-5));
    size += jacobians.back().cols();
  }
  Eigen::MatrixXd jacobian(2, size);
  for (Eigen::Index column = 0; const Eigen::MatrixXd& part : jacobians) {
    jacobian.middleCols(column, part.cols()) = part;
    column += part.cols();
  }
  return jacobian * result.covariance.of(blocks, state) * jacobian.transpose();
}

Rig rig_of(const BundleResult& result) {
  Rig rig = result.state.rig;
  rig.covariance = result.covariance.of_rig_and(result.body_motions);
  return rig;
}

double largest_difference(const Eigen::Matrix2d& a, const Eigen::Matrix2d& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

void expect_by_differences(const BundleResult& result, std::size_t sensor, const BodyMotions& motions) {
  const auto uncertainty = ProjectionUncertainty::create(rig_of(result), sensor);
  ASSERT_TRUE(uncertainty) << uncertainty.error().message;
  const Lens& lens = result.state.rig.sensors[sensor].lens;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(30, 60), Eigen::Vector2d(700, 500)}) {
    for (const double distance_mm : {500.0, 4000.0}) {
      const Eigen::Vector3d point = distance_mm * lens.ray(pixel).value().normalized();
      const Eigen::Matrix2d found = uncertainty->at_pixel(pixel, distance_mm).value();
      const Eigen::Matrix2d expected = by_differences(result, sensor, point, motions);
      EXPECT_LT(largest_difference(found, expected), 1e-5) << found << "\n\n" << expected;
    }
  }
}

BundleResult refined(const CalibrationState& start, const Observations& observations, BundleOptions options = {}) {
  auto result = refine(start, observations, options);
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

const SyntheticOptions kNoisy{
    .placements = 6, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1};

// Made once.
const Rig& noisy_rig() {
  static const Rig rig = [] {
    const Synthetic made = make_synthetic(kNoisy);
    return rig_of(refined(made.truth, made.observations));
  }();
  return rig;
}

TEST(ProjectionUncertainty, MatchesCentralDifferencesOfCameraAndProjector) {
  const Synthetic made = make_synthetic(kNoisy);
  const BundleResult result = refined(made.truth, made.observations);
  for (const std::size_t sensor : {0u, 1u}) expect_by_differences(result, sensor, of_placements);
}

TEST(ProjectionUncertainty, MatchesCentralDifferencesOnAMovedProbe) {
  const MadeSystem made = make_system({.stations = 12, .placements = 2, .tracker_placements = 6});
  const BundleResult result = refined(made.truth, made.observations);
  // The probe sees placements 0 and 1 in turns, the trackers the other six.
  const auto before_probe = [](const CalibrationState& from, const CalibrationState& to) {
    std::vector<Pose> motions;
    for (std::size_t s = 0; s < from.world_from_probe.size(); ++s) {
      const Pose before = from.world_from_probe[s].inverse() * from.world_from_board[s % 2];
      motions.push_back(to.world_from_probe[s].inverse() * to.world_from_board[s % 2] * before.inverse());
    }
    return motions;
  };
  const auto before_trackers = [](const CalibrationState& from, const CalibrationState& to) {
    std::vector<Pose> motions = of_placements(from, to);
    motions.erase(motions.begin(), motions.begin() + 2);
    return motions;
  };
  for (std::size_t sensor = 0; sensor < result.state.rig.sensors.size(); ++sensor) {
    const bool tracker = result.state.rig.sensors[sensor].mount == Mount::world;
    expect_by_differences(result, sensor, tracker ? BodyMotions(before_trackers) : before_probe);
  }
}

// Trackers that saw no board: the LEDs at each station are the bodies.
TEST(ProjectionUncertainty, MatchesCentralDifferencesOfTrackersThatSawLedsAlone) {
  const MadeSystem made = make_system({.projector = false, .stations = 16, .placements = 1, .tracker_placements = 0});
  const BundleResult result = refined(made.truth, made.observations);
  const auto constellations = [](const CalibrationState& from, const CalibrationState& to) {
    std::vector<Pose> motions;
    for (std::size_t s = 0; s < from.world_from_probe.size(); ++s) {
      std::vector<Eigen::Vector3d> before, after;
      for (std::size_t l = 0; l < from.rig.leds.size(); ++l) {
        before.push_back(from.world_from_probe[s] * from.rig.leds[l].position_mm);
        after.push_back(to.world_from_probe[s] * to.rig.leds[l].position_mm);
      }
      motions.push_back(rigid_fit(before, after).value());
    }
    return motions;
  };
  expect_by_differences(result, *made.truth.rig.find("track1"), constellations);
}

// Over independent campaigns the error of a fixed point's pixel, whitened by its predicted covariance, is chi-square
// distributed with two degrees of freedom.
TEST(ProjectionUncertainty, IsTrueOverCampaigns) {
  constexpr int kCampaigns = 40;
  double sum = 0;
  for (int c = 0; c < kCampaigns; ++c) {
    Synthetic made = make_synthetic({.placements = 5, .corner_sigma_px = 0.1, .seed = 50 + static_cast<unsigned>(c)});
    made.observations.stripes.clear();
    made.observations.features.clear();
    const BundleResult result = refined(made.truth, made.observations, {.reject_outliers = false});
    const auto uncertainty = ProjectionUncertainty::create(rig_of(result), 0).value();
    const Eigen::Vector2d pixel(100, 150);
    const Eigen::Vector3d point = 900 * result.state.rig.sensors[0].lens.ray(pixel).value().normalized();
    const Eigen::Vector2d error = pixel_of_fixed(result.state, made.truth, 0, point, of_placements) - pixel;
    sum += error.dot(uncertainty.at_pixel(pixel, 900).value().inverse() * error);
  }
  // A sum of 2 n squares of unit variance: mean 2 n, standard deviation 2 sqrt(n).
  EXPECT_NEAR(sum, 2 * kCampaigns, 3.5 * 2 * std::sqrt(kCampaigns));
}

// Held instead of the first sensor's mount: that of another, and of the placements the first.
TEST(ProjectionUncertainty, DependsOnNoGauge) {
  const Synthetic made = make_synthetic(kNoisy);
  const BundleResult usual = refined(made.truth, made.observations);
  using Kind = BlockId::Kind;
  const BundleResult by_projector =
      refined(usual.state, made.observations, {.held = {{Kind::mount, 1}}, .freed = {{Kind::mount, 0}}});
  const BundleResult by_board =
      refined(usual.state, made.observations, {.held = {{Kind::placement, 0}}, .freed = {{Kind::mount, 0}}});
  for (const std::size_t sensor : {0u, 1u}) {
    const auto expected = ProjectionUncertainty::create(rig_of(usual), sensor).value();
    for (const BundleResult* other : {&by_projector, &by_board}) {
      const auto found = ProjectionUncertainty::create(rig_of(*other), sensor).value();
      for (const double distance_mm : {700.0, kInfinity}) {
        const Eigen::Vector2d pixel(200, 600);
        EXPECT_LT(largest_difference(found.at_pixel(pixel, distance_mm).value(),
                                     expected.at_pixel(pixel, distance_mm).value()),
                  1e-6);
      }
    }
  }
}

TEST(ProjectionUncertainty, FarAwayBecomesThatOfInfinity) {
  const auto uncertainty = ProjectionUncertainty::create(noisy_rig(), 0).value();
  const Eigen::Vector2d pixel(900, 40);
  EXPECT_LT(
      largest_difference(uncertainty.at_pixel(pixel, 1e11).value(), uncertainty.at_pixel(pixel, kInfinity).value()),
      1e-6);
}

// A splined lens depends on few of its parameters at a time; the covariance of all of them must come out.
TEST(ProjectionUncertainty, OfASplinedLensIsTheDenseProduct) {
  const Lens lens = Lens::undistorted("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=6_fov_x_deg=70", {1024, 768},
                                      900, 905, {515, 380})
                        .value();
  Rig rig;
  rig.sensors = {{"cam0", SensorKind::camera, lens, {}}};
  for (const std::string& name : lens_parameter_names(lens.model())) rig.covariance.names.push_back("cam0." + name);
  const auto lens_rows = static_cast<Eigen::Index>(rig.covariance.names.size());
  for (const std::string& name : datum_names(Mount::probe)) rig.covariance.names.push_back(name);
  const auto rows = lens_rows + 6;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(rows, rows, [&] { return 1e-3 * normal(generator); });
  rig.covariance.matrix = root * root.transpose();
  const auto uncertainty = ProjectionUncertainty::create(rig, 0).value();
  const Eigen::Vector3d point(120, -90, 600);
  const Projection projection = lens.project_with_gradients(point).value();
  Eigen::MatrixXd d(2, rows);
  d << projection.d_parameters, -projection.d_point * cross_matrix(point), projection.d_point;
  EXPECT_LT(largest_difference(uncertainty.at_point(point).value(), d * rig.covariance.matrix * d.transpose()), 1e-12);
}

TEST(ProjectionUncertaintyMap, CoversTheImageTheSameAtAnyThreadCount) {
  const auto uncertainty = ProjectionUncertainty::create(noisy_rig(), 0).value();
  const auto map = projection_uncertainty_map(uncertainty, 7, 5, 800, 1);
  const auto again = projection_uncertainty_map(uncertainty, 7, 5, 800, 3);
  EXPECT_EQ(map.pixel(0, 0), Eigen::Vector2d(0, 0));
  EXPECT_EQ(map.pixel(6, 4), Eigen::Vector2d(1023, 767));
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      EXPECT_EQ(map.at(column, row), again.at(column, row));
      EXPECT_EQ(map.at(column, row), uncertainty.at_pixel(map.pixel(column, row), 800));
    }
  }
  // The boards were in the middle.
  EXPECT_LT(map.sigma_px(3, 2).value(), 0.5 * map.sigma_px(0, 0).value());
}

TEST(ProjectionUncertainty, SaysWhatTheRigLacks) {
  const Synthetic made = make_synthetic(kNoisy);
  const auto none = ProjectionUncertainty::create(made.truth.rig, 0);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("no covariance"), std::string::npos) << none.error().message;
  Rig older = noisy_rig();
  const auto keep = static_cast<Eigen::Index>(older.covariance.names.size()) - 6;
  older.covariance.names.resize(static_cast<std::size_t>(keep));
  older.covariance.matrix = older.covariance.matrix.topLeftCorner(keep, keep).eval();
  const auto refused = ProjectionUncertainty::create(older, 0);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("probe.datum_rotation_x"), std::string::npos) << refused.error().message;
}

// mrcal weighs every coordinate as 1 px and, without its regularisation, knows no prior.
TEST(ProjectionUncertainty, EqualsMrcals) {
  if (!python_has("mrcal")) GTEST_SKIP() << "Debian's python3-mrcal is not installed";
  const Campaign campaign = make_campaign({.cameras = 2, .boards = 8, .corners = 5, .model = "LENSMODEL_OPENCV5"});
  const CalibrationState& state = campaign.start;
  const auto views = make_views(campaign.observations, state.board_of);
  const Parameters parameters(state, views, {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}});
  const auto evaluate = [&](std::size_t v, ViewEvaluation& at) { return views[v]->evaluate(state, true, at); };
  const NormalEquations equations = NormalEquations::of(views, parameters, evaluate, 1).value();
  auto covariance = JointCovariance::create(equations, state).value();
  covariance.sharpen(views, evaluate, {}, state, 1);
  std::vector<const View*> all;
  for (const auto& view : views) all.push_back(view.get());
  Rig rig = state.rig;
  rig.covariance = covariance.of_rig_and(mean_body_motions(all, state));
  const MrcalPeer peer(campaign, 5);
  constexpr int kColumns = 5, kRows = 4;
  const auto uncertainty = ProjectionUncertainty::create(rig, 1).value();
  const auto map = projection_uncertainty_map(uncertainty, kColumns, kRows, 2000, 1);
  const PeerUncertainty theirs = peer.uncertainty(1, kColumns, kRows, 2000, false);
  for (std::size_t i = 0; i < theirs.covariance_px2.size(); ++i) {
    EXPECT_LT(largest_difference(*map.covariance_px2[i], theirs.covariance_px2[i]), 1e-6) << "cell " << i;
  }
}

TEST(WorstDirectionSigma, IsTheLargerEigenvaluesRoot) {
  EXPECT_NEAR(worst_direction_sigma((Eigen::Matrix2d() << 4, 0, 0, 1).finished()), 2, 1e-15);
  EXPECT_NEAR(worst_direction_sigma((Eigen::Matrix2d() << 2.5, 1.5, 1.5, 2.5).finished()), 2, 1e-15);
}

}  // namespace
}  // namespace crumple
