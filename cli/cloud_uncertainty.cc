#include "cli/cloud_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/point_uncertainty.h"
#include "calib/view_offsets.h"
#include "datasets/stations_file.h"

namespace crumple {
namespace {

float median_of(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

CloudUncertainty::CloudUncertainty(const Rig& rig) : rig_(rig) {
  if (rig.covariance.names.empty()) refuse("the rig has no covariance");
}

void CloudUncertainty::refuse(const std::string& reason) {
  if (refusal_.empty()) refusal_ = reason;
}

void CloudUncertainty::add_tracked(const std::string& station, const StationPose& where) {
  if (!refusal_.empty()) return;
  const auto known = std::find_if(poses_.stations.begin(), poses_.stations.end(),
                                  [&](const PosedStation& s) { return s.name == station; });
  station_ = static_cast<std::size_t>(known - poses_.stations.begin());
  if (known != poses_.stations.end()) return;
  const Pose& pose = where.constellation.pose.world_from_probe;
  const auto d_rig = d_pose_d_rig(rig_, used_readings(rig_, where.constellation), pose);
  if (!d_rig) return refuse(fmt::format("station {}: {}", station, d_rig.error().message));
  add_station({station, pose}, *d_rig, where.constellation.pose.covariance, poses_);
}

void CloudUncertainty::restate(const std::string& station, const Matrix6d& covariance) {
  for (std::size_t s = 0; s < poses_.stations.size(); ++s) {
    if (poses_.stations[s].name != station) continue;
    const auto row = 6 * static_cast<Eigen::Index>(s);
    poses_.covariance.block<6, 6>(row, row) = covariance;
  }
}

void CloudUncertainty::add_untracked(const std::string& station) {
  if (!refusal_.empty()) return;
  const auto rows = static_cast<Eigen::Index>(rig_.covariance.names.size());
  station_ = poses_.stations.size();
  add_station({station, {}}, Eigen::MatrixXd::Zero(6, rows), Matrix6d::Zero(), poses_);
}

void CloudUncertainty::add_view(const std::string& camera, const std::string& projector,
                                const std::vector<OrientationReport>& orientations) {
  if (!refusal_.empty()) return;
  MeasuredView view{station_, *rig_.find(camera), *rig_.find(projector), {}};
  for (const OrientationReport& orientation : orientations) {
    if (orientation.used) view.angles_rad.push_back(orientation.angle_rad);
  }
  poses_.views.push_back(std::move(view));
}

void CloudUncertainty::add_columns(Cloud& cloud, int threads) {
  const auto uncertainty =
      refusal_.empty() ? PointUncertainty::create(rig_, poses_) : Expected<PointUncertainty>(fail(refusal_));
  const auto parts = uncertainty.and_then([&](const PointUncertainty& known) { return known.parts(cloud, threads); });
  if (!parts) {
    refusal_ = parts.error().message;
    summary_ = {{"lacks", refusal_}};
    text_ = "no uncertainty but that of decoding: " + refusal_ + "\n";
    return;
  }
  const std::vector<ViewOffset> offsets = view_offsets(cloud, *uncertainty);
  for (std::size_t v = 0; v < offsets.size(); ++v) {
    if (offsets[v].points > 0) offset_sigmas_mm_[v] = offsets[v].sigma_mm;
  }
  CloudColumn calibration{"u_calibration_mm", {}}, station{"u_station_mm", {}};
  std::vector<float> decoding;
  for (std::size_t i = 0; i < parts->size(); ++i) {
    calibration.values.push_back(static_cast<float>(std::sqrt((*parts)[i].calibration.trace())));
    station.values.push_back(static_cast<float>(std::sqrt(std::max((*parts)[i].station.trace(), 0.0))));
    decoding.push_back(std::sqrt(cloud.points[i].covariance_mm2.trace()));
  }
  const float by_calibration = median_of(calibration.values), by_station = median_of(station.values),
              by_decoding = median_of(std::move(decoding));
  const bool scale_known = uncertainty->scale_variables() > 0;
  summary_ = {{"median_calibration_mm", by_calibration},
              {"median_station_mm", by_station},
              {"median_decoding_mm", by_decoding},
              {"scale_known", scale_known}};
  text_ = fmt::format("a point's u (k = 1, median): calibration {:.4f} mm, station {:.4f} mm, decoding {:.4f} mm",
                      by_calibration, by_station, by_decoding);
  if (!scale_known) {
    text_ += "; that of the scale is unknown and not in it";
  } else if (!rig_.scale_lacks.empty()) {
    summary_["scale_lacks"] = rig_.scale_lacks;
    text_ += fmt::format("; that of the scale is not complete: {}", fmt::join(rig_.scale_lacks, "; "));
  }
  text_ += "\n";
  cloud.columns.push_back(std::move(calibration));
  cloud.columns.push_back(std::move(station));
}

Expected<void> CloudUncertainty::write(const std::filesystem::path& folder) const {
  if (!refusal_.empty()) return {};
  return write_stations(folder, rig_, poses_);
}

}  // namespace crumple
