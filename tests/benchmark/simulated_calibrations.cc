#include "tests/benchmark/simulated_calibrations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "calib/detect_target.h"
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

Expected<SeenBoard> look(const Scene& scene, const TracedBoard& traced, std::uint64_t seed) {
  cv::Mat white;
  std::vector<cv::Mat> images(traced.light.size());
  for (std::size_t f = 0; f < images.size(); ++f) {
    const bool whole = scene.frames[f].kind == FrameContent::Kind::white;
    const cv::Mat1f light = whole ? traced.light[f] : traced.light[f](traced.box);
    const cv::Mat image = expose(scene.cameras[camera].detector, light, noise_seed(seed, traced.station, camera, f));
    if (whole) white = image;
    images[f] = whole ? image(traced.box).clone() : image;
  }
  const StripeImages stripes =
      sorted_into_stacks(scene.projector->sensor.lens.size(), scene.orientations, scene.frames, images);
  const auto board = detect_target(white, scene.board->target());
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
  to.data.board_of.push_back(0);
  to.data.observations.placement_count = to.truth.placement_count = to.data.placement_names.size();
  to.data.observations.corners.push_back(std::move(seen.corners));
  to.truth.corners.push_back(std::move(seen.true_corners));
  std::move(seen.stripes.begin(), seen.stripes.end(), std::back_inserter(to.data.observations.stripes));
  std::move(seen.true_stripes.begin(), seen.true_stripes.end(), std::back_inserter(to.truth.stripes));
  to.data.pairs.push_back(std::move(seen.pairs));
}

std::vector<SimulatedCalibration> without_observations(const Scene& scene, const std::vector<std::uint64_t>& seeds) {
  SimulatedCalibration empty;
  for (const Sensor& sensor : true_rig(scene).sensors) {
    empty.data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model()});
  }
  empty.data.boards = {{"board", scene.board->target(), {}}};
  std::vector<SimulatedCalibration> all(seeds.size(), empty);
  for (std::size_t i = 0; i < seeds.size(); ++i) all[i].seed = seeds[i];
  return all;
}

double normal_draw(MixGenerator& generator, double sigma) {
  return std::normal_distribution<double>(0, sigma)(generator);
}

// Sums of errors; `squares` is per coordinate.
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
};

// Of the means of many sums, less what `count` draws of their own scatter would leave in a mean.
double common_rms(const std::vector<ErrorSum>& sums, int dimensions) {
  double squares = 0;
  for (const ErrorSum& one : sums) {
    const double scatter = one.squares / one.count - one.mean().squaredNorm();
    squares += one.mean().squaredNorm() - (one.count > 1 ? scatter / (one.count - 1) : 0);
  }
  return std::sqrt(std::max(0.0, squares / (dimensions * static_cast<double>(std::max<std::size_t>(1, sums.size())))));
}

template <typename Map>
std::vector<ErrorSum> values_of(const Map& map) {
  std::vector<ErrorSum> values;
  for (const auto& [key, value] : map) values.push_back(value);
  return values;
}

}  // namespace

Expected<std::vector<SimulatedCalibration>> simulate_calibrations(
    const Scene& scene, const std::vector<std::uint64_t>& seeds, int threads,
    const std::function<void(const std::string&)>& report) {
  if (scene.cameras.size() != 1 || !scene.projector || !scene.board) {
    return fail(fmt::format("scene {}: one camera, a projector and a board are needed", scene.name));
  }
  auto all = without_observations(scene, seeds);
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
    report(scene.stations[station].id + " traced");
    std::vector<Expected<SeenBoard>> seen(seeds.size());
    parallel_for(seeds.size(), threads, [&](std::size_t i) { seen[i] = look(scene, traced, seeds[i]); });
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      if (!seen[i]) {
        return fail(fmt::format("{}, seed {}: {}", scene.stations[station].id, seeds[i], seen[i].error().message));
      }
      append(std::move(*seen[i]), scene.stations[station].id, all[i]);
    }
    ++placement;
    report(scene.stations[station].id + " seen");
  }
  return all;
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
  std::map<std::pair<std::size_t, int>, ErrorSum> corners;
  std::map<std::pair<std::size_t, double>, ErrorSum> views;
  ErrorSum all_corners, all_stripes;
  for (const SimulatedCalibration& one : all) {
    for (std::size_t v = 0; v < one.truth.corners.size(); ++v) {
      const CornerView& view = one.data.observations.corners[v];
      for (std::size_t i = 0; i < view.pixels.size(); ++i) {
        const Eigen::Vector2d error = view.pixels[i] - one.truth.corners[v].pixels[i];
        corners[{v, view.corners[i]}].add(error);
        all_corners.add(error);
      }
    }
    for (std::size_t v = 0; v < one.truth.stripes.size(); ++v) {
      const StripeView& view = one.data.observations.stripes[v];
      ErrorSum of_view;
      for (std::size_t i = 0; i < view.coordinates_px.size(); ++i) {
        const double error = view.coordinates_px[i] - one.truth.stripes[v].coordinates_px[i];
        if (std::abs(error) > gross_px) continue;
        of_view.add({error, 0});
        all_stripes.add({error, 0});
      }
      views[{view.placement, view.normal.x()}].add(of_view.mean());
    }
  }
  ObservationErrors errors;
  errors.corner_rms_px = std::sqrt(all_corners.squares / (2 * std::max(1.0, all_corners.count)));
  errors.corner_common_rms_px = common_rms(values_of(corners), 2);
  errors.corner_mean_px = all_corners.mean();
  errors.stripe_rms_px = std::sqrt(all_stripes.squares / std::max(1.0, all_stripes.count));
  errors.stripe_common_rms_px = common_rms(values_of(views), 1);
  errors.stripe_mean_px = all_stripes.mean().x();
  return errors;
}

}  // namespace crumple
