#include "calib/unknown_probe.h"

#include <algorithm>
#include <vector>

#include "solvers/closed_form/rigid_fit.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kExact_mm = 1e-6;  // the frame's own uncertainty: a covariance must have an inverse

// Onto the nominal places, by three or more of them that are not on a line; else none.
std::optional<Pose> nominal_from_leds(const Rig& rig, const std::map<std::string, Eigen::Vector3d>& nominal_mm) {
  std::vector<Eigen::Vector3d> from, to;
  for (const Led& led : rig.leds) {
    const auto place = nominal_mm.find(led.name);
    if (led.mount != Mount::probe || place == nominal_mm.end()) continue;
    from.push_back(led.position_mm);
    to.push_back(place->second);
  }
  if (from.size() < 3) return std::nullopt;
  const auto pose = rigid_fit(from, to);
  return pose ? std::optional(*pose) : std::nullopt;
}

// What is left of LED coordinates without rigid motions of all of them together.
Eigen::MatrixXd without_rigid_motions(const std::vector<Eigen::Vector3d>& leds_mm) {
  const auto count = static_cast<Eigen::Index>(leds_mm.size());
  Eigen::MatrixXd motions(3 * count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d& p = leds_mm[static_cast<std::size_t>(i)];
    motions.block<3, 3>(3 * i, 0) << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
    motions.block<3, 3>(3 * i, 3).setIdentity();
  }
  return Eigen::MatrixXd::Identity(3 * count, 3 * count) -
         motions * solve_symmetric(motions.transpose() * motions, motions.transpose());
}

// The rows of LEDs on the probe turned into their new frame and freed from the frame's own uncertainty; what trackers
// share with them is turned likewise.
void restate(const Pose& nominal_from_leds, Rig& rig) {
  std::vector<Eigen::Vector3d> leds_mm;
  Eigen::MatrixXd change = Eigen::MatrixXd::Identity(rig.covariance.matrix.rows(), rig.covariance.matrix.rows());
  std::vector<Eigen::Index> rows;
  for (Led& led : rig.leds) {
    if (led.mount != Mount::probe) continue;
    led.position_mm = nominal_from_leds * led.position_mm;
    const auto& names = rig.covariance.names;
    const auto row = std::find(names.begin(), names.end(), led.name + ".x") - names.begin();
    if (row == static_cast<std::ptrdiff_t>(names.size())) continue;
    leds_mm.push_back(led.position_mm);
    rows.push_back(row);
    change.block<3, 3>(row, row) = nominal_from_leds.rotation.toRotationMatrix();
  }
  const Eigen::MatrixXd shape = without_rigid_motions(leds_mm);
  Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(change.rows(), change.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      projection.block<3, 3>(rows[i], rows[k]) =
          shape.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(k));
    }
  }
  change = projection * change;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(change.rows(), change.rows());
  rig.covariance.matrix =
      change * rig.covariance.matrix * change.transpose() + kExact_mm * kExact_mm * (one - projection);
}

}  // namespace

Expected<UnknownProbe> unknown_probe(const CalibrationData& data, const EarlierRig& trackers,
                                     const std::map<std::string, Eigen::Vector3d>& nominal_mm, int threads) {
  CalibrationOptions options{.warp = WarpChoice::off, .bundle = {.threads = threads}, .earlier = trackers};
  auto calibration = calibrate(data, options);
  if (!calibration) return tl::unexpected(calibration.error());
  UnknownProbe probe{calibrated_rig(*calibration), std::move(*calibration)};
  restate(nominal_from_leds(probe.rig, nominal_mm).value_or(Pose{}), probe.rig);
  return probe;
}

}  // namespace crumple
