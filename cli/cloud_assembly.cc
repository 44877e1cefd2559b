#include "cli/cloud_assembly.h"

#include <cstdint>
#include <utility>

#include "recon/move_cloud.h"
#include "recon/smooth.h"

namespace crumple {
namespace {

void append(Cloud part, const std::string& station, Cloud& cloud) {
  auto& stations = cloud.stations;
  cloud.frame = part.frame;
  if (stations.empty() || stations.back() != station) stations.push_back(station);
  for (CloudPoint& point : part.points) {
    point.station = static_cast<std::uint16_t>(stations.size() - 1);
    cloud.points.push_back(point);
  }
}

}  // namespace

RemovedPoints CloudAssembly::add(const Cloud& view, std::uint16_t index, const std::string& station,
                                 const Eigen::Vector3d& camera_in_probe_mm, const std::optional<StationPlace>& place) {
  // Without cleaning its spacing is still wanted.
  CleanedCloud clean;
  if (options_.clean || (options_.merge && !merger_)) {
    clean = cleaned(view, camera_in_probe_mm, {.threads = options_.threads});
  }
  if (!options_.clean) {
    clean.cloud = view;
    clean.removed = {};
  }
  if (clean.cloud.points.empty()) return clean.removed;
  for (CloudPoint& point : clean.cloud.points) point.view = index;
  if (stations_.empty() || stations_.back() != station) {
    stations_.push_back(station);
    cameras_mm_.push_back(place ? place->world_from_probe * camera_in_probe_mm : camera_in_probe_mm);
  }
  Cloud placed = place ? moved(std::move(clean.cloud), place->world_from_probe, "world") : std::move(clean.cloud);
  if (!options_.merge) {
    append(std::move(placed), station, appended_);
    return clean.removed;
  }
  if (!merger_) {
    const double spacing = options_.spacing_mm > 0 ? options_.spacing_mm : clean.spacing_mm;
    merger_.emplace(MergeOptions{.spacing_mm = spacing, .threads = options_.threads});
  }
  placed.stations = {station};
  merger_->add(placed, place.value_or(StationPlace{}));
  return clean.removed;
}

AssembledCloud CloudAssembly::finish() {
  AssembledCloud result;
  if (merger_) {
    MergedCloud merged = merger_->finish();
    merger_.reset();
    result.cloud = std::move(merged.cloud);
    result.merged = std::move(merged.report);
  } else {
    result.cloud = std::move(appended_);
  }
  if (options_.smooth_radius_mm > 0) {
    SmoothedCloud smooth =
        smoothed(result.cloud, cameras_mm_, {.radius_mm = options_.smooth_radius_mm, .threads = options_.threads});
    result.cloud = std::move(smooth.cloud);
    result.not_smoothed = smooth.left_alone;
  }
  return result;
}

}  // namespace crumple
