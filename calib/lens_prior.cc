#include "calib/lens_prior.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kRational = 0.3;
constexpr double kPrism = 0.1;
constexpr double kAxis_rad = 0.1;
constexpr double kAlongRadius = 0.5;
constexpr double kAcrossRadius = 0.05;
constexpr double kFocal = 0.5;    // of itself
constexpr double kMiddle = 0.25;  // of the image
constexpr double kMountTurn_rad = 1;
constexpr double kMountPlace_mm = 2000;
constexpr double kLedPlace_mm = 1000;
constexpr double kConvention = 1e-4;  // of the focal length; radians
constexpr double kNoKnowledge = 10;   // of a control point: far more than any lens
constexpr int kInnermost = 4;
constexpr double kSame = 1e-9;  // squares of distances to the axis: ties go by the order of the points

// Slope of the corner of the image that is farthest from the principal point.
double farthest_slope(const Lens& lens) {
  const std::vector<double>& p = lens.parameters();
  double farthest = 0;
  for (const double x : {-0.5, lens.size().width_px - 0.5}) {
    for (const double y : {-0.5, lens.size().height_px - 0.5}) {
      farthest = std::max(farthest, std::hypot((x - p[2]) / p[0], (y - p[3]) / p[1]));
    }
  }
  return farthest;
}

// Sigma of each term that has a weak prior, by its name; independent of each other.
std::map<std::string, double> sigmas_of(const Lens& lens) {
  if (lens.model() == "LENSMODEL_CAHVOR") return {{"alpha", kAxis_rad}, {"beta", kAxis_rad}};
  const double slope = farthest_slope(lens);
  std::map<std::string, double> sigmas;
  if (lens.parameter_count() >= 12) {
    for (int power = 1; power <= 3; ++power) {
      sigmas["k" + std::to_string(3 + power)] = kRational / std::pow(slope, 2 * power);
    }
  }
  if (lens.parameter_count() >= 16) {
    for (const char* linear : {"s1", "s3"}) sigmas[linear] = kPrism / slope;
    for (const char* cubic : {"s2", "s4"}) sigmas[cubic] = kPrism / std::pow(slope, 3);
  }
  return sigmas;
}

// A prior on some parameters of a lens, about `mean`.
Prior on_lens(const std::string& name, const CalibrationState& start, std::size_t sensor, const std::vector<int>& rows,
              const std::vector<double>& mean, const Eigen::MatrixXd& covariance) {
  CalibrationState about = start;
  about.rig.sensors[sensor].lens = start.rig.sensors[sensor].lens.with_parameters(mean);
  std::vector<PriorTerm> terms;
  for (const int row : rows) terms.push_back({{BlockId::Kind::lens, sensor}, row});
  return Prior::create(start.rig.sensors[sensor].name + name, std::move(terms), std::move(about), covariance).value();
}

std::optional<Prior> on_parametric(const CalibrationState& start, std::size_t sensor) {
  const Lens& lens = start.rig.sensors[sensor].lens;
  const std::map<std::string, double> sigmas = sigmas_of(lens);
  if (sigmas.empty()) return std::nullopt;
  const std::vector<std::string> names = lens_parameter_names(lens.model());
  std::vector<double> mean = lens.parameters();
  std::vector<int> rows;
  std::vector<double> variances;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto sigma = sigmas.find(names[i]);
    if (sigma == sigmas.end()) continue;
    mean[i] = 0;
    rows.push_back(static_cast<int>(i));
    variances.push_back(sigma->second * sigma->second);
  }
  const Eigen::VectorXd diagonal =
      Eigen::Map<const Eigen::VectorXd>(variances.data(), static_cast<Eigen::Index>(variances.size()));
  return on_lens(".weak", start, sensor, rows, mean, diagonal.asDiagonal()).as_weak();
}

// Where a control point stands, in stereographic coordinates.
Eigen::Vector2d knot(const Lens& lens, int index) {
  const SplineGrid grid = lens.spline_grid();
  return {grid.x[static_cast<std::size_t>(index) % grid.x.size()],
          grid.y[static_cast<std::size_t>(index) / grid.x.size()]};
}

Prior on_control_points(const CalibrationState& start, std::size_t sensor) {
  const Lens& lens = start.rig.sensors[sensor].lens;
  std::vector<double> mean = lens.parameters();
  std::fill(mean.begin() + 4, mean.end(), 0.0);
  const int count = lens.parameter_count() - 4;
  std::vector<int> rows;
  for (int i = 0; i < count; ++i) rows.push_back(4 + i);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  for (int i = 0; i < count; i += 2) {
    const Eigen::Vector2d u = knot(lens, i / 2);
    // Directions mean nothing near the axis.
    const double along = kAcrossRadius + (kAlongRadius - kAcrossRadius) * std::min(1.0, u.norm());
    const Eigen::Vector2d radial = u.stableNormalized();
    covariance.block<2, 2>(i, i) = kAcrossRadius * kAcrossRadius * Eigen::Matrix2d::Identity() +
                                   (along * along - kAcrossRadius * kAcrossRadius) * radial * radial.transpose();
  }
  return on_lens(".weak", start, sensor, rows, mean, covariance).as_weak();
}

Prior on_scale(const CalibrationState& start, std::size_t sensor) {
  return on_lens(".core", start, sensor, {6}, start.rig.sensors[sensor].lens.parameters(),
                 Eigen::MatrixXd::Constant(1, 1, kConvention * kConvention));
}

Prior on_core(const CalibrationState& start, std::size_t sensor) {
  const Lens& lens = start.rig.sensors[sensor].lens;
  const double sigma_px = kConvention * lens.parameters()[0];
  return on_lens(".core", start, sensor, {0, 1, 2, 3}, lens.parameters(),
                 sigma_px * sigma_px * Eigen::Matrix4d::Identity());
}

// What the innermost control points have in common as a rotation of the sensor would move them, and nothing else.
Prior on_axis(const CalibrationState& start, std::size_t sensor) {
  const Lens& lens = start.rig.sensors[sensor].lens;
  std::vector<std::pair<double, int>> by_distance;
  for (int point = 0; point < (lens.parameter_count() - 4) / 2; ++point) {
    by_distance.emplace_back(kSame * std::round(knot(lens, point).squaredNorm() / kSame), point);
  }
  std::sort(by_distance.begin(), by_distance.end());
  by_distance.resize(kInnermost);
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& [distance, point] : by_distance) middle += knot(lens, point) / kInnermost;
  std::vector<int> rows;
  // The points' steps by those of their mean, x and y, and of their turn about it.
  Eigen::MatrixXd moved(2 * kInnermost, 3);
  for (int i = 0; i < kInnermost; ++i) {
    const int point = by_distance[static_cast<std::size_t>(i)].second;
    rows.insert(rows.end(), {4 + 2 * point, 5 + 2 * point});
    const Eigen::Vector2d u = knot(lens, point) - middle;
    moved.row(2 * i) << 1, 0, -u.y();
    moved.row(2 * i + 1) << 0, 1, u.x();
  }
  const Eigen::MatrixXd q = orthogonal_triangular(moved).q;
  const Eigen::MatrixXd others = q.rightCols(2 * kInnermost - 3);
  return on_lens(".axis", start, sensor, rows, lens.parameters(),
                 kNoKnowledge * kNoKnowledge * (others * others.transpose()) +
                     kConvention * kConvention * (moved * moved.transpose()));
}

}  // namespace

std::vector<Prior> lens_priors(const CalibrationState& start) {
  std::vector<Prior> priors;
  for (std::size_t s = 0; s < start.rig.sensors.size(); ++s) {
    if (start.rig.sensors[s].lens_of) continue;
    const Lens& lens = start.rig.sensors[s].lens;
    if (lens.model() == "LENSMODEL_CAHVOR") priors.push_back(on_scale(start, s));
    if (lens.splined()) {
      priors.push_back(on_core(start, s));
      priors.push_back(on_axis(start, s));
      priors.push_back(on_control_points(start, s));
    } else if (auto prior = on_parametric(start, s)) {
      priors.push_back(*std::move(prior));
    }
  }
  return priors;
}

Prior whole_rig_prior(const CalibrationState& start) {
  std::vector<PriorTerm> terms;
  std::vector<double> sigmas;
  const auto add = [&](BlockId::Kind kind, std::size_t index, const std::vector<double>& of_rows) {
    for (std::size_t row = 0; row < of_rows.size(); ++row) terms.push_back({{kind, index}, static_cast<int>(row)});
    sigmas.insert(sigmas.end(), of_rows.begin(), of_rows.end());
  };
  for (std::size_t s = 0; s < start.rig.sensors.size(); ++s) {
    const Sensor& sensor = start.rig.sensors[s];
    const std::vector<double>& p = sensor.lens.parameters();
    const ImageSize size = sensor.lens.size();
    if (!sensor.lens_of) {
      add(BlockId::Kind::lens, s, {kFocal * p[0], kFocal * p[1], kMiddle * size.width_px, kMiddle * size.height_px});
    }
    const double turn = kMountTurn_rad, place = kMountPlace_mm;
    add(BlockId::Kind::mount, s, {turn, turn, turn, place, place, place});
  }
  for (std::size_t l = 0; l < start.rig.leds.size(); ++l) {
    add(BlockId::Kind::led, l, {kLedPlace_mm, kLedPlace_mm, kLedPlace_mm});
  }
  const Eigen::VectorXd all =
      Eigen::Map<const Eigen::VectorXd>(sigmas.data(), static_cast<Eigen::Index>(sigmas.size()));
  return Prior::create("rig", std::move(terms), start, all.cwiseAbs2().asDiagonal()).value().as_weak();
}

}  // namespace crumple
