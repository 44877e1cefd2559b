#include "calib/determined_part.h"

#include <algorithm>
#include <utility>

#include "calib/image_cells.h"
#include "calib/lens_prior.h"
#include "calib/sensor_uncertainty.h"
#include "solvers/projection_uncertainty.h"
#include "tracking/median.h"

namespace crumple {
namespace {

constexpr double kAssumedFocal = 1.2;  // image widths

std::vector<std::string> open_terms(const Calibration& calibration) {
  std::vector<std::string> open;
  const std::string whole_rig = whole_rig_prior(calibration.start).name();
  for (const Undetermined& direction : calibration.bundle.undetermined) {
    if (direction.prior != whole_rig) continue;
    for (const std::string& term : direction.terms) {
      if (std::find(open.begin(), open.end(), term) == open.end()) open.push_back(term);
    }
  }
  return open;
}

// Over the image, of the pixels that see something at all.
template <typename CovarianceAt>
std::optional<double> median_px(const Lens& lens, CovarianceAt covariance_at) {
  std::vector<double> sigmas_px;
  const ImageCells cells = image_cells({}, lens.size());
  for (std::size_t cell = 0; cell < cells.cells.size(); ++cell) {
    const auto ray = lens.ray(cells.centre_px(cell));
    if (!ray || !(ray->z() > 0)) continue;
    if (const auto covariance = covariance_at(*ray)) sigmas_px.push_back(worst_direction_sigma(*covariance));
  }
  if (sigmas_px.empty()) return std::nullopt;
  return median_of(std::move(sigmas_px));
}

}  // namespace

std::optional<DeterminedPart> determined_part(CalibrationData data, CalibrationOptions options) {
  data.may_be_open = true;
  options.warp = WarpChoice::off;
  for (SensorSpec& sensor : data.sensors) sensor.assumed_focal_px = kAssumedFocal * sensor.size.width_px;
  const auto calibration = calibrate(data, options);
  if (!calibration) return std::nullopt;
  DeterminedPart part{open_terms(*calibration), {}};
  if (part.open.empty()) return std::nullopt;

  const Rig rig = calibrated_rig(*calibration);
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    const auto depth_mm = median_depth_mm(s, calibration->bundle);
    const auto uncertainty = ProjectionUncertainty::create(rig, s);
    if (!depth_mm || !uncertainty) continue;
    const Lens& lens = rig.sensors[s].lens;
    const auto there_px =
        median_px(lens, [&](const Eigen::Vector3d& ray) { return uncertainty->at_point(*depth_mm / ray.z() * ray); });
    const auto far_px = median_px(lens, [&](const Eigen::Vector3d& ray) { return uncertainty->at_infinity(ray); });
    if (there_px && far_px) part.projections.push_back({rig.sensors[s].name, *there_px, *far_px});
  }
  return part;
}

}  // namespace crumple
