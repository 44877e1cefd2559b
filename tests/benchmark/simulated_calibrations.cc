#include "tests/benchmark/simulated_calibrations.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "calib/detect_board.h"
#include "calib/stripe_observations.h"
#include "datasets/capture.h"
#include "datasets/render/render.h"
#include "datasets/render/sampling.h"
#include "datasets/render/sensor.h"
#include "recon/station.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t camera = 0;
constexpr std::size_t projector = 1;

// One placement, traced.
struct TracedBoard {
  std::size_t station = 0;
  std::size_t placement = 0;
  std::vector<cv::Mat1f> light;  // per frame
  cv::Rect box;                  // the board with a rim, all that is decoded
  TrueGeometry geometry;
  CornerView corners;  // true ones
};

// What one noise realisation shows of one placement.
struct SeenBoard {
  CornerView corners, true_corners;
  std::vector<StripeView> stripes, true_stripes;
  PixelPairs pairs;
};

CornerView true_corners_of(const TracedBoard& traced, const CornerView& seen) {
  CornerView view = seen;
  for (std::size_t i = 0; i < seen.corners.size(); ++i) {
    const auto& known = traced.corners.corners;
    const auto found = std::find(known.begin(), known.end(), seen.corners[i]);
    if (found != known.end()) view.pixels[i] = traced.corners.pixels[static_cast<std::size_t>(found - known.begin())];
  }
  return view;
}

// Readings where the truth has none (in shadow, off the panel) keep what was read.
StripeView true_stripes_of(const TracedBoard& traced, const StripeView& seen) {
  StripeView view = seen;
  for (std::size_t i = 0; i < seen.camera_pixels.size(); ++i) {
    const Eigen::Vector2i at = seen.camera_pixels[i].cast<int>();
    const cv::Vec2d lit_by = traced.geometry.projector_px(at.y(), at.x());
    if (std::isfinite(lit_by[0])) view.coordinates_px[i] = seen.normal.dot(Eigen::Vector2d(lit_by[0], lit_by[1]));
  }
  return view;
}

// Decoding the whole image would take three times as long and tell nothing more of the board.
cv::Rect box_around(const CornerView& corners, const ImageSize& size) {
  constexpr float rim_px = 40;
  std::vector<cv::Point2f> points;
  for (const Eigen::Vector2d& p : corners.pixels) {
    points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  const auto [left, right] =
      std::minmax_element(points.begin(), points.end(), [](auto a, auto b) { return a.x < b.x; });
  const auto [top, bottom] =
      std::minmax_element(points.begin(), points.end(), [](auto a, auto b) { return a.y < b.y; });
  const cv::Rect rimmed(cv::Point(static_cast<int>(left->x - rim_px), static_cast<int>(top->y - rim_px)),
                        cv::Point(static_cast<int>(right->x + rim_px), static_cast<int>(bottom->y + rim_px)));
  return rimmed & cv::Rect(0, 0, size.width_px, size.height_px);
}

void move_by(const cv::Point& offset, std::vector<Eigen::Vector2d>& pixels) {
  for (Eigen::Vector2d& pixel : pixels) pixel += Eigen::Vector2d(offset.x, offset.y);
}

Expected<SeenBoard> look(const Scene& scene, const TracedBoard& traced, int threads) {
  cv::Mat white;
  std::vector<cv::Mat> images(traced.light.size());
  parallel_for(images.size(), threads, [&](std::size_t f) {
    const bool whole = scene.frames[f].kind == FrameContent::Kind::white;
    const cv::Mat1f light = whole ? traced.light[f] : traced.light[f](traced.box);
    const cv::Mat image =
        expose(scene.cameras[camera].detector, light, noise_seed(scene.seed, traced.station, camera, f));
    if (whole) white = image;
    images[f] = whole ? image(traced.box).clone() : image;
  });
  const StripeImages stripes =
      sorted_into_stacks(scene.projector->sensor.lens.size(), scene.orientations, scene.frames, images);
  const auto board = detect_board(white, scene.board->board());
  if (!board) return tl::unexpected(board.error());
  auto readings = read_stripes(stripes, {});
  if (!readings) return tl::unexpected(readings.error());

  SeenBoard seen;
  seen.corners = {camera, traced.placement, board->corners, board->pixels};
  seen.true_corners = true_corners_of(traced, seen.corners);
  const BoardStripes decoded{camera, projector, traced.placement, std::move(*readings)};
  const cv::Mat hull = corner_hull(board->pixels, white.size())(traced.box).clone();
  seen.stripes = stripe_views(decoded, hull, {});
  if (seen.stripes.empty()) return fail("the projector lights none of the board");
  for (StripeView& view : seen.stripes) {
    move_by(traced.box.tl(), view.camera_pixels);
    seen.true_stripes.push_back(true_stripes_of(traced, view));
  }
  seen.pairs = pixel_pairs(decoded, hull, {});
  move_by(traced.box.tl(), seen.pairs.camera_pixels);
  return seen;
}

void append(SeenBoard seen, const std::string& name, SimulatedCalibration& to) {
  to.data.placement_names.push_back(name);
  to.data.observations.placement_count = to.truth.placement_count = to.data.placement_names.size();
  to.data.observations.corners.push_back(std::move(seen.corners));
  to.truth.corners.push_back(std::move(seen.true_corners));
  std::move(seen.stripes.begin(), seen.stripes.end(), std::back_inserter(to.data.observations.stripes));
  std::move(seen.true_stripes.begin(), seen.true_stripes.end(), std::back_inserter(to.truth.stripes));
  to.data.pairs.push_back(std::move(seen.pairs));
}

SimulatedCalibration without_observations(const Scene& scene) {
  SimulatedCalibration empty;
  empty.seed = scene.seed;
  for (const Sensor& sensor : true_rig(scene).sensors) {
    empty.data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model()});
  }
  empty.data.board = scene.board->board();
  empty.data.board.warp_mm.setZero();  // as a capture describes it
  return empty;
}

Eigen::Vector3d even_draw(MixGenerator& generator, double reach) {
  std::uniform_real_distribution<double> draw(-reach, reach);
  const double x = draw(generator), y = draw(generator), z = draw(generator);
  return {x, y, z};
}

double normal_draw(MixGenerator& generator, double sigma) {
  return std::normal_distribution<double>(0, sigma)(generator);
}

// Sums of errors.
struct ErrorSum {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0;
  double count = 0;
  void add(const Eigen::Vector2d& error) {
    sum += error;
    squares += error.squaredNorm();
    ++count;
  }
  Eigen::Vector2d mean() const { return sum / std::max(1.0, count); }
  double rms(int dimension) const { return std::sqrt(squares / (dimension * std::max(1.0, count))); }
};

}  // namespace

Scene redrawn(const Scene& scene, std::uint64_t seed) {
  constexpr double reach_mm = 8, reach_rad = 3 * std::numbers::pi / 180;
  Scene other = scene;
  other.seed = seed;
  MixGenerator generator(mix(seed, 3));
  for (SceneStation& station : other.stations) {
    Pose& pose = station.probe_from_surface;
    pose.rotation = rotation_from_vector(even_draw(generator, reach_rad)) * pose.rotation;
    pose.translation += even_draw(generator, reach_mm);
  }
  return other;
}

Expected<SimulatedCalibration> simulate_calibration(const Scene& scene, int threads) {
  if (scene.cameras.size() != 1 || !scene.projector || !scene.board) {
    return fail(fmt::format("scene {}: one camera, a projector and a board are needed", scene.name));
  }
  SimulatedCalibration simulated = without_observations(scene);
  const Observations ideal = ideal_observations(scene, 100);
  const Renderer renderer(scene, threads);
  std::size_t placement = 0;
  for (std::size_t station = 0; station < scene.stations.size(); ++station) {
    if (!scene.stations[station].board) continue;
    const CornerView& corners = ideal.corners[placement];
    const TracedBoard traced{station,
                             placement,
                             renderer.radiances(station, camera),
                             box_around(corners, scene.cameras[camera].sensor.lens.size()),
                             renderer.true_geometry(station, camera),
                             corners};
    auto seen = look(scene, traced, threads);
    if (!seen) {
      return fail(fmt::format("{}, seed {}: {}", scene.stations[station].id, scene.seed, seen.error().message));
    }
    append(std::move(*seen), scene.stations[station].id, simulated);
    ++placement;
  }
  return simulated;
}

CalibrationData with_true_corners(const SimulatedCalibration& simulated, double sigma_px) {
  CalibrationData data = simulated.data;
  data.observations.corners = simulated.truth.corners;
  MixGenerator generator(mix(simulated.seed, 1));
  for (CornerView& view : data.observations.corners) {
    for (Eigen::Vector2d& pixel : view.pixels) {
      pixel.x() += normal_draw(generator, sigma_px);
      pixel.y() += normal_draw(generator, sigma_px);
    }
  }
  return data;
}

CalibrationData with_true_stripes(const SimulatedCalibration& simulated, double sigma_px) {
  CalibrationData data = simulated.data;
  data.observations.stripes = simulated.truth.stripes;
  MixGenerator generator(mix(simulated.seed, 2));
  for (StripeView& view : data.observations.stripes) {
    for (double& coordinate : view.coordinates_px) coordinate += normal_draw(generator, sigma_px);
  }
  return data;
}

ObservationErrors observation_errors(const std::vector<SimulatedCalibration>& all) {
  constexpr double gross_px = 1;  // decoding errors that the refinement leaves out
  ErrorSum corners, stripes, corner_means, stripe_means;
  for (const SimulatedCalibration& one : all) {
    for (std::size_t v = 0; v < one.truth.corners.size(); ++v) {
      const CornerView& view = one.data.observations.corners[v];
      ErrorSum of_view;
      for (std::size_t i = 0; i < view.pixels.size(); ++i) {
        of_view.add(view.pixels[i] - one.truth.corners[v].pixels[i]);
        corners.add(view.pixels[i] - one.truth.corners[v].pixels[i]);
      }
      corner_means.add(of_view.mean());
    }
    for (std::size_t v = 0; v < one.truth.stripes.size(); ++v) {
      const StripeView& view = one.data.observations.stripes[v];
      ErrorSum of_view;
      for (std::size_t i = 0; i < view.coordinates_px.size(); ++i) {
        const double error = view.coordinates_px[i] - one.truth.stripes[v].coordinates_px[i];
        if (std::abs(error) > gross_px) continue;
        of_view.add({error, 0});
        stripes.add({error, 0});
      }
      stripe_means.add(of_view.mean());
    }
  }
  ObservationErrors errors;
  errors.corner_rms_px = corners.rms(2);
  errors.corner_mean_px = corners.mean();
  errors.corner_view_mean_rms_px = corner_means.rms(2);
  errors.stripe_rms_px = stripes.rms(1);
  errors.stripe_mean_px = stripes.mean().x();
  errors.stripe_view_mean_rms_px = stripe_means.rms(1);
  return errors;
}

}  // namespace crumple
