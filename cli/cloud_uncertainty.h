// What the uncertainty of a cloud, or of stations alone, is computed from, gathered while it is made: where its
// stations were, which views it was made of, and the rig; columns for the cloud, and the files that `crumple measure`
// reads (datasets/stations_file.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/station_poses.h"
#include "datasets/station_pose.h"
#include "recon/station.h"

namespace crumple {

class CloudUncertainty {
 public:
  // The rig must outlive this.
  explicit CloudUncertainty(const Rig& rig);

  // Why there is none, in words; the first reason counts. Nothing is written then.
  void refuse(const std::string& reason);

  // Stations that were refined together, before any is added.
  void know(StationPoses poses) { poses_ = std::move(poses); }

  // A station that was posed by its LEDs, or whose probe frame is the cloud's.
  void add_tracked(const std::string& station, const StationPose& where);
  // What LED pixels leave open of a station's pose, where that turned out to be more than was taken for it.
  void restate(const std::string& station, const Matrix6d& covariance);
  void add_untracked(const std::string& station);
  // A view of the station added last; returns its index. To be told once, when its points are known.
  std::uint16_t next_view() const { return static_cast<std::uint16_t>(poses_.views.size()); }
  void add_view(const std::string& camera, const std::string& projector,
                const std::vector<OrientationReport>& orientations);

  // Columns u_calibration_mm and u_station_mm, roots of the traces of the covariances; and what the summary says.
  void add_columns(Cloud& cloud, int threads);

  // After add_columns: by view, how well rig and poses say its height over the earlier ones in a merged cloud.
  const std::map<std::size_t, double>& offset_sigmas_mm() const { return offset_sigmas_mm_; }

  const nlohmann::json& summary() const { return summary_; }
  std::string text() const { return text_; }
  Expected<void> write(const std::filesystem::path& folder) const;

 private:
  const Rig& rig_;
  StationPoses poses_;
  std::size_t station_ = 0;  // the one added last
  std::string refusal_;
  std::map<std::size_t, double> offset_sigmas_mm_;
  nlohmann::json summary_;
  std::string text_;
};

}  // namespace crumple
