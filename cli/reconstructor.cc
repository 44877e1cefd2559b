#include "cli/reconstructor.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "cli/pose_flags.h"
#include "cli/progress.h"
#include "recon/map_image.h"

namespace crumple {

Reconstructor::Reconstructor(const Capture& capture, const Rig& rig, const ReconstructorOptions& options,
                             std::vector<ComparedRig> compared_rigs, std::size_t stations)
    : compared(std::move(compared_rigs)),
      uncertainty(rig),
      capture_(capture),
      rig_(rig),
      options_(options),
      tracked_(is_tracked(capture, rig)),
      near_(options.near) {
  AssemblyOptions assembly = options.assembly;
  assembly.merge = assembly.merge && tracked_ && stations > 1;
  for (const NamedEstimator& named : options.estimators) {
    reconstruction.estimators.push_back(named.name);
    clouds.push_back({named.name, CloudAssembly(assembly)});
  }
  for (ComparedRig& beside : compared) beside.assembly.emplace(assembly);
  if (options.pose == PoseMethod::markers) uncertainty.refuse(kMarkersLack);
  if (options.estimators.front().estimator != Estimator::weighted) {
    uncertainty.refuse("it is told for points of the estimator weighted alone");
  }
}

void Reconstructor::go_to(const std::string& station) {
  const auto known = refined_.find(station);
  if (known != refined_.end()) {
    where_ = known->second;
    near_.posed(station, *where_);
  } else if (tracked_) {
    where_ = options_.pose == PoseMethod::pixels ? near_.pose(capture_, rig_, station)
                                                 : station_pose(capture_, rig_, station, options_.pose);
  }
  if (tracked_ && where_ && where_->constellation.pose.choice) {
    reconstruction.choices.emplace_back(station, *where_->constellation.pose.choice);
  }
  if (tracked_ && where_ && !where_->stillness.tested()) reconstruction.stillness_not_tested.push_back(station);
  if (tracked_ && where_) places_[station] = where_->constellation.pose.world_from_probe;
  if (tracked_ && where_ && options_.pose == PoseMethod::pixels) posed_.emplace_back(station, where_->constellation);
  if (!tracked_) uncertainty.add_untracked(station);
  if (tracked_ && where_) uncertainty.add_tracked(station, *where_);
}

void Reconstructor::add(const std::string& station, const SensorPair& pair) {
  if (pair.projector != capture_.projector_at(station)) return;
  if (const auto exclusion = capture_.exclusion(station, pair.camera)) {
    return log_line(fmt::format("station {}, {} is excluded: {}", station, pair.camera, exclusion->reason));
  }
  const auto parts = where_ ? reconstruct(station, pair) : tl::unexpected(where_.error());
  if (!parts) {
    reconstruction.failed.push_back({station, pair.camera, parts.error().message});
    return;
  }
  for (std::size_t i = 0; i < parts->size(); ++i) {
    const StationCloud& part = (*parts)[i];
    const RemovedPoints removed = clouds[i].assembly.add(part.cloud, uncertainty.next_view(), station,
                                                         pair.geometry.probe_from_cam.translation, station_place());
    reconstruction.views.push_back({station, pair.camera, clouds[i].estimator, part.cloud.points.size(),
                                    part.decoded_fraction, part.median_sigma_mm, part.orientations, removed});
  }
  uncertainty.add_view(pair.camera, pair.projector, parts->front().orientations);
}

void Reconstructor::hold_against(const Rig& calibrated) {
  if (posed_.empty()) return;
  reconstruction.rig = posed_rig(calibrated, posed_);
  if (!refined_.empty()) return;  // sigmas were told anew there
  for (const auto& [station, where] : posed_) {
    uncertainty.restate(station, restated_covariance(rig_, where, reconstruction.rig.noisier));
  }
}

Expected<void> Reconstructor::finish() {
  for (NamedCloud& named : clouds) {
    AssembledCloud assembled = named.assembly.finish();
    if (assembled.cloud.points.empty()) return fail(named.estimator + ": cleaning left no point; see --noclean");
    named.cloud = std::move(assembled.cloud);
    reconstruction.clouds.push_back(
        {named.estimator, named.cloud.points.size(), std::move(assembled.merged), assembled.not_smoothed});
  }
  for (ComparedRig& beside : compared) beside.cloud = beside.assembly->finish().cloud;
  uncertainty.add_columns(clouds.front().cloud, options_.assembly.threads);
  reconstruction.clouds.front().offset_sigmas_mm = uncertainty.offset_sigmas_mm();
  reconstruction.uncertainty = uncertainty.summary();
  reconstruction.uncertainty_text = uncertainty.text();
  return {};
}

Expected<void> Reconstructor::map_images(const std::vector<std::string>& stations) {
  Cloud& cloud = clouds.front().cloud;
  for (const CaptureSensor& camera : capture_.sensors) {
    const auto index = rig_.find(camera.name);
    if (!camera.ambient_only || !index) continue;
    if (!tracked_ && stations.size() > 1) {
      log_warning(fmt::format("{} is not mapped: clouds of several stations are in no common frame", camera.name));
      continue;
    }
    ImageMapper mapper(cloud);
    for (const std::string& station : stations) {
      const auto place = places_.find(station);
      if ((tracked_ && place == places_.end()) || capture_.exclusion(station, camera.name)) continue;
      const auto image = read_frame(capture_, camera.name, station, 0);
      if (!image) return tl::unexpected(image.error());
      const Pose probe_from_cloud = tracked_ ? place->second.inverse() : Pose{};
      const Sensor& sensor = rig_.sensors[*index];
      mapper.add(*image, sensor.lens, sensor.sensor_from_mount * probe_from_cloud);
    }
    cloud.columns.push_back({camera.name, mapper.values()});
    cloud.columns.push_back({camera.name + "_views", mapper.views()});
  }
  return {};
}

std::optional<StationPlace> Reconstructor::station_place() const {
  if (!tracked_) return std::nullopt;
  const ProbePose& pose = where_->constellation.pose;
  return StationPlace{pose.world_from_probe, pose.covariance};
}

Expected<std::vector<StationCloud>> Reconstructor::reconstruct(const std::string& station, const SensorPair& pair) {
  const auto images = read_stripe_images(capture_, pair.camera, station);
  if (!images) return tl::unexpected(images.error());
  std::vector<StationCloud> parts;
  for (const NamedEstimator& named : options_.estimators) {
    StationOptions options;
    options.estimator = named.estimator;
    options.decode.bit_rule = options_.rule;
    options.name = "station " + station;
    const auto readings = read_stripes(*images, options);
    if (!readings) return fail(fmt::format("{}: {}", options.name, readings.error().message));
    auto part = reconstruct_readings(pair.geometry, *readings, options);
    if (!part) return tl::unexpected(part.error());
    if (parts.empty()) {
      if (const auto done = add_compared(station, pair, *readings, options); !done) {
        return tl::unexpected(done.error());
      }
    }
    parts.push_back(std::move(*part));
  }
  return parts;
}

// What the rigs beside make of the same readings.
Expected<void> Reconstructor::add_compared(const std::string& station, const SensorPair& of,
                                           const StationReadings& readings, const StationOptions& options) {
  for (ComparedRig& beside : compared) {
    const auto pair = std::find_if(beside.pairs.begin(), beside.pairs.end(), [&](const SensorPair& p) {
      return p.camera == of.camera && p.projector == of.projector;
    });
    if (pair == beside.pairs.end()) continue;
    const auto part = reconstruct_readings(pair->geometry, readings, options);
    if (!part) return fail(fmt::format("{}: {}", beside.name, part.error().message));
    std::optional<StationPlace> place;
    if (tracked_) {
      const auto where = station_pose(capture_, beside.rig, station, beside.pose);
      if (!where) return fail(fmt::format("{}: {}", beside.name, where.error().message));
      place = StationPlace{where->constellation.pose.world_from_probe, where->constellation.pose.covariance};
    }
    beside.assembly->add(part->cloud, uncertainty.next_view(), station, pair->geometry.probe_from_cam.translation,
                         place);
  }
  return {};
}

}  // namespace crumple
