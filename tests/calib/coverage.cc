#include "tests/calib/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "calib/calibrate.h"
#include "calib/uncertainty_budget.h"
#include "calib/weighting.h"
#include "solvers/distribution_tails.h"
#include "solvers/parallel.h"
#include "solvers/parameters.h"
#include "solvers/projection_uncertainty.h"

namespace crumple {
namespace {

constexpr int kBatch = 64;
constexpr double kOutside = 0.05;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How well the variance of several parameters together is known.
struct KnownVariance {
  double degrees_of_freedom = kInfinity;
  double mean_square = 1;  // of an error in n dimensions by its estimated covariance, over n, where that is true
};

struct Region {
  std::string quantity;
  int dimension = 0;
  double square = 0;  // of the error, by the covariance
  KnownVariance known = {};
};

// Errors of parameters in tangents at the estimate, and their covariance; without rows that were held.
struct ParameterErrors {
  Eigen::VectorXd errors;
  Eigen::MatrixXd covariance;
};

struct Score {
  std::vector<Region> regions = {};
  ParameterErrors all = {};
  KnownVariance all_known = {};
  std::string failure = {};
};

ParameterErrors errors_of(const std::vector<BlockId>& blocks, const CalibrationState& truth,
                          const BundleResult& found) {
  const Eigen::MatrixXd covariance = found.covariance.of(blocks, found.state);
  Eigen::VectorXd errors(covariance.rows());
  Eigen::Index row = 0;
  for (const BlockId& block : blocks) {
    const Eigen::VectorXd step = block_step(block, found.state, truth);
    errors.segment(row, step.size()) = -step;
    row += step.size();
  }
  std::vector<Eigen::Index> estimated;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    if (covariance(i, i) > 0) estimated.push_back(i);
  }
  return {errors(estimated), covariance(estimated, estimated)};
}

void add_region(const std::string& quantity, const ParameterErrors& parameters, const KnownVariance& known,
                std::vector<Region>& regions) {
  if (parameters.errors.size() == 0) return;
  const Eigen::VectorXd sigma = parameters.covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd z = parameters.errors.cwiseQuotient(sigma);
  const Eigen::MatrixXd correlation =
      sigma.cwiseInverse().asDiagonal() * parameters.covariance * sigma.cwiseInverse().asDiagonal();
  regions.push_back({quantity, static_cast<int>(z.size()), z.dot(correlation.ldlt().solve(z)), known});
}

// Of F with so many degrees of freedom of its denominator.
double f_mean(double degrees_of_freedom) {
  return std::isfinite(degrees_of_freedom) ? degrees_of_freedom / (degrees_of_freedom - 2) : 1;
}

// Of a part of the rig, "LEDs" or "all", as the budget has it. Of points' pixels that of their lens is taken.
class KnownVariances {
 public:
  KnownVariances(const Observations& observations, const Calibration& calibration)
      : regions_(uncertainty_budget(observations, calibration, 1).regions) {}

  KnownVariance of(const std::string& part) const {
    const auto found = std::find_if(regions_.begin(), regions_.end(), [&](const auto& r) { return r.part == part; });
    return found == regions_.end() ? KnownVariance{} : KnownVariance{found->degrees_of_freedom, found->mean};
  }

 private:
  std::vector<BudgetRegion> regions_;
};

// Calls visit(pixel, point in the sensor's frame) for a grid over the image, at the distance the sensor works at.
template <typename Visit>
void for_each_grid_point(const Sensor& sensor, const Visit& visit) {
  const double depth_mm = sensor.mount == Mount::world ? 2500 : 800;
  for (int row = 1; row <= 4; ++row) {
    for (int column = 1; column <= 5; ++column) {
      const Eigen::Vector2d pixel(column * sensor.lens.size().width_px / 6.0, row * sensor.lens.size().height_px / 5.0);
      if (const auto ray = sensor.lens.ray(pixel)) visit(pixel, Eigen::Vector3d(*ray * depth_mm));
    }
  }
}

// Points fixed to the mount.
void add_projections(std::size_t s, const CalibrationState& truth, const BundleResult& found,
                     const KnownVariance& known, std::vector<Region>& regions) {
  const Sensor& true_sensor = truth.rig.sensors[s];
  const Sensor& sensor = found.state.rig.sensors[s];
  const std::size_t lens_owner = sensor.lens_of.value_or(s);
  const Eigen::MatrixXd covariance =
      found.covariance.of({{BlockId::Kind::lens, lens_owner}, {BlockId::Kind::mount, s}}, found.state);
  for_each_grid_point(true_sensor, [&](const Eigen::Vector2d& pixel, const Eigen::Vector3d& in_sensor) {
    const Eigen::Vector3d point = true_sensor.sensor_from_mount.inverse() * in_sensor;
    const auto projection = sensor.lens.project_with_gradients(sensor.sensor_from_mount * point);
    if (!projection) return;
    Eigen::MatrixXd jacobian(2, sensor.lens.parameter_count() + 6);
    jacobian << projection->d_parameters, projection->d_point * d_transformed_d_pose(sensor.sensor_from_mount, point);
    const Eigen::Matrix2d of_pixel = jacobian * covariance * jacobian.transpose();
    const Eigen::Vector2d error = projection->pixel - pixel;
    regions.push_back(
        {"projection of " + sensor.name, 2, error.dot(Eigen::Vector2d(of_pixel.ldlt().solve(error))), known});
  });
}

// Points fixed to what was seen: the estimate's bodies are off by their mean motion, and take the points along.
void add_fixed_to_bodies(std::size_t s, const CoverageCampaign& campaign, const BundleResult& found,
                         const std::map<Mount, Vector6d>& body_motions, const KnownVariance& known,
                         std::vector<Region>& regions) {
  Rig rig = found.state.rig;
  rig.covariance = rig_covariance(found);
  const auto uncertainty = ProjectionUncertainty::create(rig, s);
  if (!uncertainty) return;
  const Sensor& true_sensor = campaign.truth.rig.sensors[s];
  const Pose& mount = rig.sensors[s].sensor_from_mount;
  const Vector6d of_mount = local_step(true_sensor.sensor_from_mount, mount);
  const Vector6d& of_bodies = body_motions.at(true_sensor.mount);
  const Eigen::Vector3d turn = of_mount.head<3>() + mount.rotation * of_bodies.head<3>();
  const Eigen::Vector3d shift =
      of_mount.tail<3>() - turn.cross(mount.translation) + mount.rotation * of_bodies.tail<3>();
  for_each_grid_point(true_sensor, [&](const Eigen::Vector2d& pixel, const Eigen::Vector3d& point) {
    const Eigen::Vector3d moved = point + turn.cross(point) + shift;
    const auto seen = rig.sensors[s].lens.project(moved);
    const auto covariance = uncertainty->at_point(moved);
    if (!seen || !covariance) return;
    const Eigen::Vector2d error = *seen - pixel;
    regions.push_back({"projection of " + true_sensor.name + ", fixed to bodies", 2,
                       error.dot(Eigen::Vector2d(covariance->ldlt().solve(error))), known});
  });
}

// By mount: what the errors of the estimate move its bodies by.
std::map<Mount, Vector6d> motions_of_bodies(const CoverageCampaign& campaign, const BundleResult& found) {
  const TangentFunction& function = found.body_motions;
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(function.names.size()));
  for (const auto& [block, part] : function.by_block) {
    motion -= part * block_step(block, found.state, campaign.truth);
  }
  std::map<Mount, Vector6d> motions;
  for (const Mount mount : {Mount::probe, Mount::world}) {
    const std::string first = datum_names(mount).front();
    const auto at = std::find(function.names.begin(), function.names.end(), first) - function.names.begin();
    if (at < motion.size()) motions[mount] = motion.segment<6>(at);
  }
  return motions;
}

Expected<Calibration> estimated(const CoverageCampaign& campaign) {
  if (campaign.measured) return calibrate(*campaign.measured, {});
  auto bundle = refine(campaign.start, campaign.observations, campaign.options);
  if (!bundle) return tl::unexpected(bundle.error());
  Calibration calibration{.start = campaign.start, .bundle = std::move(*bundle), .priors = campaign.options.priors};
  add_weighting(campaign.observations, campaign.options, calibration);
  return calibration;
}

Score score_of(const CoverageCampaign& campaign, bool judge_parameters, const FreshStations* fresh,
               std::mt19937_64& random) {
  const auto calibration = estimated(campaign);
  if (!calibration) return {.failure = calibration.error().message};
  const BundleResult& found = calibration->bundle;
  const Observations& seen = campaign.measured ? campaign.measured->observations : campaign.observations;
  const KnownVariances known(seen, *calibration);
  Score score;
  const std::map<Mount, Vector6d> body_motions = motions_of_bodies(campaign, found);
  const Rig& rig = campaign.truth.rig;
  std::vector<BlockId> all, leds, scales;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const std::string& name = rig.sensors[s].name;
    const BlockId lens{BlockId::Kind::lens, s}, mount{BlockId::Kind::mount, s};
    const KnownVariance of_lens = known.of("lens of " + rig.sensors[rig.sensors[s].lens_of.value_or(s)].name);
    if (judge_parameters) {
      add_region("lens of " + name, errors_of({lens}, campaign.truth, found), of_lens, score.regions);
      const std::string part = "mount of " + name;
      add_region(part, errors_of({mount}, campaign.truth, found), known.of(part), score.regions);
      add_projections(s, campaign.truth, found, of_lens, score.regions);
    }
    if (body_motions.contains(rig.sensors[s].mount)) {
      add_fixed_to_bodies(s, campaign, found, body_motions, of_lens, score.regions);
    }
    all.push_back(lens);
    all.push_back(mount);
  }
  if (!judge_parameters) return score;
  for (std::size_t l = 0; l < rig.leds.size(); ++l) leds.push_back({BlockId::Kind::led, l});
  for (std::size_t b = 0; b < campaign.truth.boards.size(); ++b) scales.push_back({BlockId::Kind::scale, b});
  if (!leds.empty()) add_region("LEDs", errors_of(leds, campaign.truth, found), known.of("LEDs"), score.regions);
  // A certificate tells them.
  add_region("scales", errors_of(scales, campaign.truth, found), {}, score.regions);
  all.insert(all.end(), leds.begin(), leds.end());
  all.insert(all.end(), scales.begin(), scales.end());
  score.all = errors_of(all, campaign.truth, found);
  score.all_known = known.of("all");
  add_region("all parameters", score.all, score.all_known, score.regions);
  if (fresh == nullptr) return score;
  const auto measured = measure_fresh(*fresh, found, random);
  if (!measured) return {.failure = measured.error().message};
  // As if sigma were known, which that of the stripes is; with LEDs' from a hundred readings NEES comes out 1 % high.
  for (const MeasuredError& of : *measured) {
    add_region(of.quantity, {of.error, of.covariance}, {}, score.regions);
  }
  return score;
}

// Along fixed directions, those of the first campaign, by each campaign's own covariance.
class Directions {
 public:
  void add(const ParameterErrors& parameters, const KnownVariance& known) {
    if (parameters.errors.size() == 0) return;
    if (vectors_.size() == 0) {
      sigma_ = parameters.covariance.diagonal().cwiseSqrt();
      const Eigen::MatrixXd correlation =
          sigma_.cwiseInverse().asDiagonal() * parameters.covariance * sigma_.cwiseInverse().asDiagonal();
      vectors_ = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvectors();
      squares_ = Eigen::VectorXd::Zero(vectors_.cols());
    }
    const Eigen::VectorXd errors = vectors_.transpose() * parameters.errors.cwiseQuotient(sigma_);
    const Eigen::MatrixXd scaled = sigma_.cwiseInverse().asDiagonal() * vectors_;
    for (Eigen::Index i = 0; i < errors.size(); ++i) {
      const double variance = scaled.col(i).dot(parameters.covariance * scaled.col(i));
      squares_[i] += errors[i] * errors[i] / variance / known.mean_square;
    }
    ++count_;
  }

  void write(CoverageResult& result) const {
    result.directions = static_cast<int>(squares_.size());
    for (const double sum : squares_) {
      const double variance = sum / count_, z = (variance - 1) / std::sqrt(2.0 / count_);
      if (std::abs(z) <= std::abs(result.worst_direction_z)) continue;
      result.worst_direction_variance = variance;
      result.worst_direction_z = z;
    }
  }

 private:
  Eigen::VectorXd sigma_, squares_;
  Eigen::MatrixXd vectors_;
  int count_ = 0;
};

// By quantity, in the order in which they first came.
class Table {
 public:
  void add(const std::vector<Region>& regions) {
    std::map<std::string, int> of_campaign;
    for (const Region& region : regions) {
      auto found =
          std::find_if(sums_.begin(), sums_.end(), [&](const auto& s) { return s.row.quantity == region.quantity; });
      if (found == sums_.end()) {
        sums_.push_back({{region.quantity, region.dimension}});
        found = sums_.end() - 1;
      }
      CoverageRow& row = found->row;
      const double of_mean = region.square / region.dimension / region.known.mean_square;
      const double degrees = region.known.degrees_of_freedom;
      row.coverage95 += f_tail(of_mean * f_mean(degrees), region.dimension, degrees) >= kOutside ? 1 : 0;
      row.nees_per_dof += of_mean;
      row.regions = std::max(row.regions, ++of_campaign[region.quantity]);
      row.trials += of_campaign[region.quantity] == 1 ? 1 : 0;
      found->common_variance += 2 / degrees;
    }
  }

  std::vector<CoverageRow> rows() const {
    std::vector<CoverageRow> rows;
    for (const Sums& sums : sums_) {
      CoverageRow row = sums.row;
      const double count = static_cast<double>(row.trials) * row.regions;
      row.coverage95 /= count;
      row.nees_per_dof /= count;
      row.coverage_error = std::sqrt(kOutside * (1 - kOutside) / row.trials);
      row.nees_error = std::sqrt((2.0 / row.dimension + sums.common_variance / count) / row.trials);
      rows.push_back(row);
    }
    return rows;
  }

 private:
  struct Sums {
    CoverageRow row;
    double common_variance = 0;  // of the estimated variances, common to all directions of a region; over their squares
  };
  std::vector<Sums> sums_;
};

}  // namespace

CoverageResult measure_coverage(const CoverageConfiguration& configuration, std::uint32_t seed, int trials, int threads,
                                const std::function<void(int done)>& report) {
  CoverageResult result;
  Table table;
  Directions directions;
  for (int first = 0; first < trials; first += kBatch) {
    std::vector<Score> scores(static_cast<std::size_t>(std::min(kBatch, trials - first)));
    parallel_for(scores.size(), threads, [&](std::size_t i) {
      std::seed_seq seeds{seed, static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(i)};
      std::mt19937_64 random(seeds);
      const auto campaign = configuration.draw(random);
      if (!campaign) {
        scores[i].failure = campaign.error().message;
        return;
      }
      scores[i] = score_of(*campaign, configuration.judge_parameters, configuration.fresh.get(), random);
    });
    for (const Score& score : scores) {
      if (!score.failure.empty()) {
        ++result.failed;
        result.failure = score.failure;
        continue;
      }
      table.add(score.regions);
      directions.add(score.all, score.all_known);
    }
    if (report) report(first + static_cast<int>(scores.size()));
  }
  result.rows = table.rows();
  directions.write(result);
  return result;
}

}  // namespace crumple
