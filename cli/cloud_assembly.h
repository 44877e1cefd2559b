// From the views' clouds to the one that is written: cleaned, moved to the common frame, merged, smoothed. One view's
// points at a time are in memory beside the result.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "recon/clean.h"
#include "recon/cloud.h"
#include "recon/merge.h"

namespace crumple {

struct AssemblyOptions {
  bool clean = true;
  bool merge = false;           // else points are put one behind the other
  double spacing_mm = 0;        // of merged points; 0: as the first view's points lie
  double smooth_radius_mm = 0;  // 0: not smoothed
  int threads = 1;
};

struct AssembledCloud {
  Cloud cloud;
  std::optional<MergeReport> merged = std::nullopt;
  std::size_t not_smoothed = 0;  // points with too few neighbours for it
};

class CloudAssembly {
 public:
  explicit CloudAssembly(const AssemblyOptions& options) : options_(options) {}

  // One camera's cloud of a station in the probe frame, where the camera stands in it, and where the probe stood if
  // that is known: the assembly is in the world frame then, else in the probe's. How well it is known counts where
  // stations are merged. `index` becomes the points' CloudPoint::view. Returns what cleaning took out; a view of which
  // it leaves nothing adds nothing.
  RemovedPoints add(const Cloud& view, std::uint16_t index, const std::string& station,
                    const Eigen::Vector3d& camera_in_probe_mm, const std::optional<StationPlace>& place);

  // Ends the assembly.
  AssembledCloud finish();

 private:
  AssemblyOptions options_;
  Cloud appended_;
  std::optional<CloudMerger> merger_;
  std::vector<std::string> stations_;
  std::vector<Eigen::Vector3d> cameras_mm_;  // one per station, in the assembly's frame
};

}  // namespace crumple
