#include "tests/calib/coverage_configurations.h"

#include <cmath>
#include <memory>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "calib/calibrate.h"
#include "calib/lens_prior.h"
#include "calib/rig_prior.h"
#include "solvers/parameters.h"
#include "tests/solvers/made_system.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

// What each campaign of a configuration observes before noise, and how noisy that is.
struct Scene {
  CalibrationState truth;
  Observations exact;
  NoiseLevels noise;
  BundleOptions options;
  double gross_share = 0;
};

Scene scene_of(const Synthetic& made) { return {made.truth, made.observations, {0.1, 0.08, 0.12, 0}, {}, 0}; }

// Every `kThin`-th corner and reading: enough for every group's sigma, and campaigns that take a fraction of the time.
template <typename T>
std::vector<T> thinned(const std::vector<T>& all) {
  constexpr std::size_t kThin = 4;
  std::vector<T> kept;
  for (std::size_t i = 0; i < all.size(); i += kThin) kept.push_back(all[i]);
  return kept;
}

Scene scene_of(MadeSystemOptions options) {
  const NoiseLevels noise{options.corner_sigma_px, options.stripe_sigma_px, 0, options.led_sigma_px};
  options.corner_sigma_px = options.stripe_sigma_px = options.led_sigma_px = 0;
  MadeSystem made = make_system(options);
  for (CornerView& view : made.observations.corners) {
    view.corners = thinned(view.corners);
    view.pixels = thinned(view.pixels);
  }
  for (StripeView& view : made.observations.stripes) {
    view.camera_pixels = thinned(view.camera_pixels);
    view.coordinates_px = thinned(view.coordinates_px);
  }
  return {std::move(made.truth), std::move(made.observations), noise, {}, 0};
}

// A lens of the model that differs from the one without further terms by what real lenses do.
Lens bent_lens(const std::string& model, const Lens& like) {
  const std::vector<double>& core = like.parameters();
  Lens lens = Lens::undistorted(model, like.size(), core[0], core[1], {core[2], core[3]}).value();
  std::vector<double> parameters = lens.parameters();
  if (lens.splined()) {
    const SplineGrid grid = lens.spline_grid();
    for (std::size_t row = 0, i = 4; row < grid.y.size(); ++row) {
      for (std::size_t column = 0; column < grid.x.size(); ++column) {
        const double x = grid.x[column], y = grid.y[row], squeeze = -0.05 * (x * x + y * y);
        parameters[i++] = squeeze * x;
        parameters[i++] = squeeze * y;
      }
    }
  } else {
    const std::vector<double> further{-0.11, 0.05, 4e-4, -3e-4, 0.01, 0.02, -0.01, 0.005};
    for (std::size_t i = 4; i < parameters.size(); ++i) parameters[i] = further[i - 4];
  }
  return lens.with_parameters(parameters);
}

// The camera alone before boards all over its image.
Scene one_camera(const std::string& model) {
  Synthetic made = make_synthetic({.placements = 1});
  CalibrationState truth = made.truth;
  truth.rig.sensors.pop_back();
  Sensor& camera = truth.rig.sensors[0];
  camera.lens = bent_lens(model, camera.lens);
  truth.world_from_board.clear();
  truth.board_of.clear();
  Observations seen;
  const Board& board = truth.boards[0];
  for (int p = 0; p < 12; ++p) {
    const double turn = 2.4 * p;
    Pose pose;
    pose.rotation = rotation_from_vector(0.45 * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.4 * (p % 3 - 1)));
    const Eigen::Vector3d centre(110 * (p % 4 - 1.5), 75 * (p / 4 - 1), 800 + 50 * (p % 5));
    pose.translation = centre - pose.rotation * (0.5 * board.point(board.point_count() - 1));
    CornerView view{0, static_cast<std::size_t>(p), {}, {}};
    for (int i = 0; i < board.point_count(); ++i) {
      const auto pixel = camera.lens.project(pose * board.point(i));
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > camera.lens.size().width_px - 1 ||
          pixel->y() > camera.lens.size().height_px - 1) {
        continue;
      }
      view.corners.push_back(i);
      view.pixels.push_back(*pixel);
    }
    truth.world_from_board.push_back(pose);
    truth.board_of.push_back(0);
    seen.corners.push_back(std::move(view));
  }
  seen.placement_count = truth.world_from_board.size();
  return {std::move(truth), std::move(seen), {.corner_px = 0.1}, {}, 0};
}

Scene with_lens_priors(Scene scene) {
  for (Prior& prior : lens_priors(scene.truth)) scene.options.priors.push_back(std::move(prior));
  return scene;
}

Scene with_gross_errors(Scene scene, double share) {
  scene.gross_share = share;
  return scene;
}

Scene camera_and_projector(bool by_features) {
  Scene scene = scene_of(make_synthetic({.placements = 10}));
  (by_features ? scene.exact.stripes.clear() : scene.exact.features.clear());
  return scene;
}

// Trackers that see a board, and the LEDs of a probe that carries nothing else.
Scene trackers_alone() {
  Scene scene = scene_of({.trackers = 2, .projector = false, .stations = 0, .wand_stations = 15});
  scene.truth.rig.sensors.erase(scene.truth.rig.sensors.begin());
  for (CornerView& view : scene.exact.corners) --view.sensor;
  for (LedView& view : scene.exact.leds) --view.sensor;
  return scene;
}

const MadeSystemOptions kPaperRig{.stations = 12, .placements = 2, .tracker_placements = 10};
const MadeSystemOptions kFineRig{.trackers = 4,
                                 .tracker_size = {2592, 1944},
                                 .tracker_focal_px = 3500,
                                 .leds = 8,
                                 .stations = 12,
                                 .placements = 2,
                                 .tracker_placements = 8};

// Normally distributed with the covariance root root'.
Eigen::VectorXd normal_vector(const Eigen::MatrixXd& root, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return root * Eigen::VectorXd::NullaryExpr(root.cols(), [&](Eigen::Index) { return normal(random); });
}

CoverageCampaign noisy(const Scene& scene, std::mt19937_64& random) {
  CoverageCampaign campaign{scene.truth, scene.truth, scene.exact, scene.options};
  add_noise(scene.noise, random, campaign.observations);
  if (scene.gross_share > 0) add_gross_errors(scene.gross_share, scene.noise, random, campaign.observations);
  campaign.options.reject_outliers = scene.gross_share > 0;
  return campaign;
}

CoverageConfiguration plain(const std::string& name, Scene scene, bool judge_parameters = true) {
  const auto shared = std::make_shared<const Scene>(std::move(scene));
  return {name, [shared](std::mt19937_64& random) { return noisy(*shared, random); }, judge_parameters};
}

CoverageConfiguration measuring(CoverageConfiguration configuration, const MadeSystemOptions& options) {
  configuration.fresh = std::make_shared<const FreshStations>(fresh_stations(options));
  return configuration;
}

// The boards' true scales are drawn from what their certificates say: alike for all, being of one workshop, but for a
// tenth that is each one's own.
CoverageConfiguration by_certificate(const std::string& name, Scene scene, double relative_sigma) {
  std::vector<PriorTerm> terms;
  for (std::size_t b = 0; b < scene.truth.boards.size(); ++b) terms.push_back({{BlockId::Kind::scale, b}, 0});
  const auto count = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(count, count, relative_sigma * relative_sigma);
  covariance.diagonal() *= 1.01;
  scene.options.priors.push_back(Prior::create("certificates", terms, scene.truth, covariance).value());
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  const auto shared = std::make_shared<const Scene>(std::move(scene));
  return {name, [shared, root](std::mt19937_64& random) {
            Scene drawn = *shared;
            const Eigen::VectorXd step = normal_vector(root, random);
            for (std::size_t b = 0; b < drawn.truth.boards.size(); ++b) {
              drawn.truth.boards[b].scale += step[static_cast<Eigen::Index>(b)];
            }
            drawn.exact = predicted_observations(drawn.truth, shared->exact);
            CoverageCampaign campaign = noisy(drawn, random);
            campaign.start = shared->truth;
            return campaign;
          }};
}

// An earlier rig, off by what its covariance says, corrected by new observations.
Expected<CoverageConfiguration> by_earlier_rig(const std::string& name, Scene before, Scene now) {
  std::mt19937_64 first(1);
  const CoverageCampaign campaign = noisy(before, first);
  const auto earlier = refine(campaign.start, campaign.observations, campaign.options);
  if (!earlier) return tl::unexpected(earlier.error());
  const auto shared = std::make_shared<const Scene>(std::move(now));
  const auto covariance = std::make_shared<const RigCovariance>(rig_covariance(*earlier));
  std::vector<BlockId> blocks;
  for (std::size_t s = 0; s < shared->truth.rig.sensors.size(); ++s) {
    blocks.push_back({BlockId::Kind::lens, s});
    blocks.push_back({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < shared->truth.rig.leds.size(); ++l) blocks.push_back({BlockId::Kind::led, l});
  const Eigen::MatrixXd of_blocks = earlier->covariance.of(blocks, earlier->state);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(of_blocks);
  const Eigen::MatrixXd root = parts.eigenvectors() * parts.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  return CoverageConfiguration{name, [shared, covariance, blocks, root](std::mt19937_64& random) {
                                 CoverageCampaign drawn = noisy(*shared, random);
                                 const Eigen::VectorXd step = normal_vector(root, random);
                                 Eigen::Index row = 0;
                                 for (const BlockId& block : blocks) {
                                   const int size = tangent_size(block, drawn.start);
                                   move_block(block, step.segment(row, size), drawn.start);
                                   row += size;
                                 }
                                 Rig rig = drawn.start.rig;
                                 rig.covariance = *covariance;
                                 RigPrior prior = rig_prior(rig, drawn.start, drawn.observations).value();
                                 drawn.start = std::move(prior.state);
                                 drawn.options.priors.push_back(std::move(prior.prior));
                                 drawn.options.held.insert(prior.held.begin(), prior.held.end());
                                 drawn.options.freed.insert(prior.freed.begin(), prior.freed.end());
                                 return drawn;
                               }};
}

}  // namespace

Expected<std::vector<CoverageConfiguration>> coverage_configurations() {
  const std::string splined = "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=6_fov_x_deg=44";
  MadeSystemOptions few = kPaperRig;
  few.stations = 5;
  few.tracker_placements = 3;
  few.seed = 2;
  auto continued = by_earlier_rig("two trackers, 5 LEDs; earlier rig as prior", scene_of(kPaperRig), scene_of(few));
  if (!continued) return tl::unexpected(continued.error());
  MadeSystemOptions pairs = kPaperRig;
  pairs.trackers = 0;
  pairs.projector = false;
  pairs.second_pair = true;
  pairs.placements = 1;
  return std::vector<CoverageConfiguration>{
      plain("one camera, pinhole", one_camera("LENSMODEL_PINHOLE")),
      plain("one camera, OPENCV5", one_camera("LENSMODEL_OPENCV5")),
      plain("one camera, OPENCV8 with its weak prior", with_lens_priors(one_camera("LENSMODEL_OPENCV8")), false),
      plain("one camera, splined 8x6", with_lens_priors(one_camera(splined)), false),
      plain("one camera, OPENCV5; 2 % gross errors", with_gross_errors(one_camera("LENSMODEL_OPENCV5"), 0.02)),
      plain("two cameras", scene_of(pairs)),
      plain("camera and projector by stripes", camera_and_projector(false)),
      plain("camera and projector by a cast board", camera_and_projector(true)),
      by_certificate("camera and projector by stripes; board scale 1e-3 by certificate", camera_and_projector(false),
                     1e-3),
      plain("two trackers, LEDs alone", trackers_alone()),
      measuring(plain("full chain, two trackers, 5 LEDs", scene_of(kPaperRig)), kPaperRig),
      measuring(
          plain("full chain, two trackers, 5 LEDs; 2 % gross errors", with_gross_errors(scene_of(kPaperRig), 0.02)),
          kPaperRig),
      measuring(std::move(*continued), kPaperRig),
      measuring(
          by_certificate("full chain, two trackers, 5 LEDs; board scales by certificate", scene_of(kPaperRig), 3e-4),
          kPaperRig),
      measuring(plain("full chain, four 5 MP trackers, 8 LEDs", scene_of(kFineRig)), kFineRig),
  };
}

}  // namespace crumple
