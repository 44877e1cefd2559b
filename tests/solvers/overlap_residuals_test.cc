// What two stations measured of one surface, and reference points that the probe sees in the room.
#include "solvers/overlap_residuals.h"

#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "solvers/parameters.h"
#include "solvers/sensor_chain.h"
#include "solvers/stripe_point.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

// A ball of a metre's radius, half a metre across, bulging towards the probe: it constrains every direction.
constexpr double kRadius_mm = 1000;

struct SeenPoint {
  Eigen::Vector3d in_world;
  Eigen::Vector3d normal;
};

std::vector<SeenPoint> surface_points() {
  std::vector<SeenPoint> points;
  const Eigen::Vector3d centre(0, 0, 3000 + kRadius_mm);
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 10; ++k) {
      const Eigen::Vector3d normal = Eigen::Vector3d((i - 5.5) * 0.05, (k - 4.5) * 0.05, -1).normalized();
      points.push_back({centre + kRadius_mm * normal, normal});
    }
  }
  return points;
}

// Columns of the projector at both stations, of the points that both see.
OverlapView overlap(const CalibrationState& truth, std::size_t here, std::size_t there,
                    const std::vector<SeenPoint>& points, double sigma_px, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, 1);
  const auto& sensors = truth.rig.sensors;
  OverlapView view{
      {0, 1, here, Eigen::Vector2d(0.96, 0.28), {}, {}}, {0, 1, there, Eigen::Vector2d::UnitX(), {}, {}}, {}};
  for (const SeenPoint& point : points) {
    bool seen = true;
    for (StripePoints* side : {&view.here, &view.there}) {
      const Eigen::Vector3d in_probe = truth.world_from_probe[side->station].inverse() * point.in_world;
      const auto pixel = sensors[0].lens.project(sensors[0].sensor_from_mount * in_probe);
      const auto met = stripe_coordinate(sensors[1], side->normal, in_probe);
      seen = seen && pixel && met;
      if (!seen) break;
      side->camera_pixels.push_back(*pixel);
      side->coordinates_px.push_back(met->value_px + sigma_px * noise(random));
    }
    if (!seen) {
      view.here.camera_pixels.resize(view.there_normals.size());
      view.here.coordinates_px.resize(view.there_normals.size());
      view.there.camera_pixels.resize(view.there_normals.size());
      view.there.coordinates_px.resize(view.there_normals.size());
      continue;
    }
    view.there_normals.push_back(truth.world_from_probe[there].rotation.conjugate() * point.normal);
  }
  return view;
}

// Six reference points about the surface, seen by the probe's camera at every station.
void add_targets(MadeSystem& made, double sigma_px) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0, 1);
  const std::size_t first = made.truth.rig.leds.size();
  for (int i = 0; i < 6; ++i) {
    made.truth.rig.leds.push_back({"target" + std::to_string(i),
                                   Eigen::Vector3d(120.0 * (i % 3 - 1), 100.0 * (i / 3) - 50, 2990 + 10 * i),
                                   Mount::world});
  }
  for (std::size_t s = 0; s < made.truth.world_from_probe.size(); ++s) {
    LedView view{0, {}, {}, s};
    for (std::size_t l = first; l < made.truth.rig.leds.size(); ++l) {
      const auto pixel = made.truth.rig.sensors[0].lens.project(sensor_from_leds(made.truth, 0, s).pose *
                                                                made.truth.rig.leds[l].position_mm);
      if (!pixel) continue;
      view.leds.push_back(l);
      const double x = pixel->x() + sigma_px * noise(random);
      view.pixels.emplace_back(x, pixel->y() + sigma_px * noise(random));
    }
    made.observations.leds.push_back(view);
  }
}

// Stations that see LEDs, the surface and targets; no boards.
MadeSystem scanning(double led_sigma_px, double stripe_sigma_px, double target_sigma_px, unsigned seed) {
  MadeSystem made = make_system({.stations = 0,
                                 .wand_stations = 5,
                                 .tracker_placements = 0,
                                 .turn_deg = 12,
                                 .led_sigma_px = led_sigma_px,
                                 .seed = seed});
  std::mt19937_64 random(seed + 1);
  const auto points = surface_points();
  for (std::size_t s = 0; s + 1 < made.truth.world_from_probe.size(); ++s) {
    made.observations.overlaps.push_back(overlap(made.truth, s, s + 1, points, stripe_sigma_px, random));
  }
  add_targets(made, target_sigma_px);
  return made;
}

std::set<BlockId> whole_rig(const CalibrationState& state) {
  std::set<BlockId> held;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    held.insert({BlockId::Kind::lens, s});
    held.insert({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) {
    if (state.rig.leds[l].mount == Mount::probe) held.insert({BlockId::Kind::led, l});
  }
  return held;
}

TEST(OverlapResiduals, VanishAtTheTruth) {
  const MadeSystem made = scanning(0, 0, 0, 3);
  const auto views = make_views(made.observations, made.truth.board_of);
  EXPECT_EQ(views.back()->kind(), View::Kind::overlaps);
  EXPECT_GT(views.back()->size(), 50);
  for (const auto& view : views) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(made.truth, false, evaluation));
    EXPECT_LT(evaluation.residuals.cwiseAbs().maxCoeff(), 1e-8) << name_of(view->kind()) << " at " << place_of(*view);
  }
}

// Stations a little off, so that a ray meets the plane away from its point.
TEST(OverlapResiduals, JacobiansMatchCentralDifferences) {
  const MadeSystem made = scanning(0, 0, 0, 3);
  CalibrationState state = disturbed_system(made.truth, 3);
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(state, true, evaluation));
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      const auto residuals = [&](const Eigen::VectorXd& step) {
        CalibrationState there = state;
        move_block(view->blocks()[b], step, there);
        ViewEvaluation at;
        EXPECT_TRUE(view->evaluate(there, false, at));
        return at.residuals;
      };
      const Eigen::MatrixXd analytic = block_jacobian(*view, evaluation, state, b);
      const Eigen::MatrixXd numeric = central_differences(residuals, Eigen::VectorXd::Zero(analytic.cols()));
      EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 5e-7 * (1 + analytic.cwiseAbs().maxCoeff()))
          << name_of(view->kind()) << " at " << place_of(*view) << ", block " << b;
    }
  }
}

TEST(OverlapResiduals, StationsThatMeetAreCommon) {
  MadeSystem made = scanning(0, 0, 0, 3);
  made.observations.overlaps.resize(2);  // of the first three stations
  const auto views = make_views(made.observations, made.truth.board_of);
  const Parameters parameters(made.truth, views, whole_rig(made.truth));
  for (std::size_t s = 0; s < 5; ++s) {
    const BlockId station{BlockId::Kind::station, s};
    EXPECT_TRUE(parameters.estimated(station));
    EXPECT_EQ(parameters.common_offset(station).has_value(), s < 3) << s;
    EXPECT_EQ(parameters.slot(station).has_value(), s >= 3) << s;
  }
}

TEST(OverlapResiduals, RefinementRecoversTheStations) {
  const MadeSystem made = scanning(0, 0, 0, 3);
  CalibrationState start = disturbed_system(made.truth, 5);
  start.rig.sensors = made.truth.rig.sensors;
  for (std::size_t l = 0; l < 5; ++l) start.rig.leds[l] = made.truth.rig.leds[l];
  const auto result = refine(start, made.observations, {.held = whole_rig(made.truth)});
  ASSERT_TRUE(result) << result.error().message;
  for (std::size_t s = 0; s < made.truth.world_from_probe.size(); ++s) {
    const Vector6d step = local_step(made.truth.world_from_probe[s], result->state.world_from_probe[s]);
    EXPECT_LT(step.head<3>().norm(), 1e-8) << s;
    EXPECT_LT(step.tail<3>().norm(), 1e-5) << s;
  }
  for (std::size_t l = 5; l < 11; ++l) {
    EXPECT_LT((result->state.rig.leds[l].position_mm - made.truth.rig.leds[l].position_mm).norm(), 1e-5) << l;
  }
}

// Over campaigns the errors of stations, tied and not, are as their joint covariance says.
TEST(OverlapResiduals, PredictedSigmasOfStationsAreTrue) {
  double sum = 0;
  int degrees = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    MadeSystem made = scanning(0.05, 0.1, 0.05, 50 + seed);
    made.observations.overlaps.resize(3);
    const auto result =
        refine(made.truth, made.observations, {.reject_outliers = false, .held = whole_rig(made.truth)});
    ASSERT_TRUE(result) << result.error().message;
    std::vector<BlockId> blocks;
    Eigen::VectorXd error(30);
    for (std::size_t s = 0; s < 5; ++s) {
      blocks.push_back({BlockId::Kind::station, s});
      error.segment<6>(6 * static_cast<Eigen::Index>(s)) =
          local_step(made.truth.world_from_probe[s], result->state.world_from_probe[s]);
    }
    sum += error.dot(result->covariance.of(blocks, result->state).ldlt().solve(error));
    degrees += 30;
  }
  EXPECT_NEAR(sum / degrees, 1, 4 * std::sqrt(2.0 / degrees) + 0.1);  // small groups' sigmas are estimated
}

}  // namespace
}  // namespace crumple
