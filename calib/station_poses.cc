#include "calib/station_poses.h"

#include <algorithm>
#include <map>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "solvers/bundle.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr const char* kUndetermined = "the LEDs' pixels do not determine the probe's pose";
constexpr double kUndeterminedPose = 1e-12;  // of the smallest eigenvalue of the information scaled to a unit diagonal

// Of all readings, their rows divided by the sigmas that they were fitted with.
struct WhitenedLeds {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd d_pose;
  Eigen::MatrixXd d_rig;
  Eigen::MatrixXd covariance;  // as the noise turned out; the unit matrix where it is as it was taken for
};

// What a pixel's covariance grows by: the part of it that lasts over frames is the group's sigma.
double grown_px2(const Rig& rig, const std::string& group, const NoiseFactors& noisier) {
  const auto factor = noisier.find(group);
  const auto sigma_px = rig.sigma_px.find(group);
  if (factor == noisier.end() || sigma_px == rig.sigma_px.end()) return 0;
  return (factor->second * factor->second - 1) * sigma_px->second * sigma_px->second;
}

Eigen::Index row_count(const LedReadings& readings) {
  Eigen::Index rows = 0;
  for (const LedReading& reading : readings) rows += 2 * static_cast<Eigen::Index>(reading.view.leds.size());
  return rows;
}

Expected<WhitenedLeds> whitened_leds(const Rig& rig, const LedReadings& used, const Pose& world_from_probe,
                                     const NoiseFactors& noisier = {}) {
  std::map<std::string, Eigen::Index> column_of;
  for (const std::string& name : rig.covariance.names) column_of.emplace(name, column_of.size());
  CalibrationState state{rig, {}, {}, {}, {world_from_probe}};
  Observations observations;
  for (const LedReading& reading : used) {
    observations.leds.push_back(reading.view);
    observations.leds.back().station = 0;
  }
  const auto views = make_views(observations, {});
  const Eigen::Index rows = row_count(used);
  WhitenedLeds result{Eigen::VectorXd::Zero(rows), Eigen::MatrixXd::Zero(rows, 6),
                      Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(rig.covariance.names.size())),
                      Eigen::MatrixXd::Identity(rows, rows)};
  Eigen::Index row = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    ViewEvaluation evaluation;
    if (!views[v]->evaluate(state, true, evaluation)) {
      return fail(fmt::format("{} has no pixel for an LED at its station", rig.sensors[used[v].view.sensor].name));
    }
    const Eigen::Index count = evaluation.residuals.size();
    Eigen::MatrixXd whiten = Eigen::MatrixXd::Zero(count, count);
    for (Eigen::Index i = 0; 2 * i < count; ++i) {
      const auto root = inverse_cholesky_factor(used[v].covariances_px2[static_cast<std::size_t>(i)]);
      if (!root) return fail(fmt::format("{}: the covariance of an LED's pixel is not sound", v));
      whiten.block<2, 2>(2 * i, 2 * i) = *root;
    }
    const double grown = grown_px2(rig, group_name(rig, used[v].view.sensor, View::Kind::leds), noisier);
    result.covariance.block(row, row, count, count) += grown * whiten * whiten.transpose();
    result.residuals.segment(row, count) = whiten * evaluation.residuals;
    for (std::size_t b = 0; b < views[v]->blocks().size(); ++b) {
      const BlockId& block = views[v]->blocks()[b];
      const Eigen::MatrixXd jacobian = whiten * block_jacobian(*views[v], evaluation, state, b);
      if (block.kind == BlockId::Kind::station) {
        result.d_pose.middleRows(row, count) += jacobian;
        continue;
      }
      const std::vector<std::string> names = parameter_names(block, state);
      for (std::size_t i = 0; i < names.size(); ++i) {
        const auto column = column_of.find(names[i]);
        if (column == column_of.end()) continue;
        result.d_rig.col(column->second).segment(row, count) += jacobian.col(static_cast<Eigen::Index>(i));
      }
    }
    row += count;
  }
  return result;
}

}  // namespace

void add_station(const PosedStation& station, const Eigen::MatrixXd& d_rig, const Matrix6d& covariance,
                 StationPoses& poses) {
  const auto before = 6 * static_cast<Eigen::Index>(poses.stations.size());
  poses.stations.push_back(station);
  poses.d_rig.conservativeResize(before + 6, d_rig.cols());
  poses.d_rig.bottomRows(6) = d_rig;
  poses.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(before + 6, before + 6));
  poses.covariance.bottomRightCorner<6, 6>() = covariance;
}

Expected<Eigen::MatrixXd> d_pose_d_rig(const Rig& rig, const LedReadings& used, const Pose& world_from_probe) {
  const auto leds = whitened_leds(rig, used, world_from_probe);
  if (!leds) return tl::unexpected(leds.error());
  const auto inverse = inverse_information(leds->d_pose.transpose() * leds->d_pose, kUndeterminedPose);
  if (!inverse) return fail(kUndetermined);
  return Eigen::MatrixXd(-*inverse * (leds->d_pose.transpose() * leds->d_rig));
}

Expected<Matrix6d> pose_covariance(const Rig& rig, const LedReadings& used, const Pose& world_from_probe,
                                   const NoiseFactors& noisier) {
  const auto leds = whitened_leds(rig, used, world_from_probe, noisier);
  if (!leds) return tl::unexpected(leds.error());
  const auto inverse = inverse_information(leds->d_pose.transpose() * leds->d_pose, kUndeterminedPose);
  if (!inverse) return fail(kUndetermined);
  const Eigen::MatrixXd estimator = *inverse * leds->d_pose.transpose();
  return Matrix6d(estimator * leds->covariance * estimator.transpose());
}

Expected<PoseMisfit> pose_misfit(const Rig& rig, const LedReadings& used, const Pose& world_from_probe,
                                 const NoiseFactors& noisier) {
  const auto leds = whitened_leds(rig, used, world_from_probe, noisier);
  if (!leds) return tl::unexpected(leds.error());
  const Eigen::MatrixXd by_rig = leds->d_rig * rig.covariance.matrix * leds->d_rig.transpose();
  const auto root = inverse_cholesky_factor(Eigen::MatrixXd(leds->covariance + by_rig));
  if (!root) return fail("the covariance of the LEDs' pixels is not sound");
  const Eigen::VectorXd residuals = *root * leds->residuals;
  const Eigen::MatrixXd d_pose = *root * leds->d_pose;
  const auto inverse = inverse_information(d_pose.transpose() * d_pose, kUndeterminedPose);
  if (!inverse) return fail(kUndetermined);
  const Vector6d explained = d_pose.transpose() * residuals;
  PoseMisfit misfit;
  misfit.redundancy = static_cast<int>(residuals.size()) - 6;
  misfit.chi_square = std::max(0.0, residuals.squaredNorm() - explained.dot(Vector6d(*inverse * explained)));
  if (misfit.redundancy > 0) misfit.probability = chi_square_tail(misfit.chi_square, misfit.redundancy);
  return misfit;
}

}  // namespace crumple
