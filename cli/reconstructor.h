// Clouds from the images of a capture, station after station: what `crumple reconstruct` does with every view.
//
// Images of one view at a time are in memory. A view fails as a whole: clouds of one run show the same stations.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/cloud_assembly.h"
#include "cli/cloud_uncertainty.h"
#include "cli/reconstruct_summary.h"
#include "cli/sensor_pairs.h"
#include "datasets/capture.h"
#include "datasets/near_poses.h"
#include "datasets/station_pose.h"
#include "recon/station.h"

namespace crumple {

struct NamedEstimator {
  std::string name;
  Estimator estimator;
};

struct ReconstructorOptions {
  PoseMethod pose = PoseMethod::pixels;
  NearPoses near = {};  // as it is before the first station
  std::vector<NamedEstimator> estimators;
  BitRule rule = BitRule::inverse;
  AssemblyOptions assembly = {};  // but for whether there is something to merge
};

// All points of one estimator.
struct NamedCloud {
  std::string estimator;
  CloudAssembly assembly;
  Cloud cloud = {};
};

// A rig beside the main one, and the cloud it makes of the same readings, posed from triangulated markers.
struct ComparedRig {
  std::string name;
  Rig rig;
  std::vector<SensorPair> pairs;
  PoseMethod pose = PoseMethod::markers;
  std::optional<CloudAssembly> assembly = std::nullopt;
  Cloud cloud = {};
};

// Refers to its capture, rig and options.
class Reconstructor {
 public:
  // `stations`: how many there will be.
  Reconstructor(const Capture& capture, const Rig& rig, const ReconstructorOptions& options,
                std::vector<ComparedRig> compared_rigs, std::size_t stations);

  // Where stations are, if that is known better than by each one's LEDs.
  void place(std::map<std::string, StationPose> refined) { refined_ = std::move(refined); }

  // To be called before add() of a station: where the probe was, if it is tracked.
  void go_to(const std::string& station);

  // One camera's view with the projector that showed the patterns there. What fails is noted in `reconstruction`.
  void add(const std::string& station, const SensorPair& pair);

  // After the last add(): whether the rig that was calibrated holds at the stations, of a probe that is tracked by
  // pixels, and what that makes of the stations' uncertainty.
  void hold_against(const Rig& calibrated);

  // After that: the clouds, the main one with its uncertainty. Fails where cleaning left nothing of a cloud.
  Expected<void> finish();

  // After finish(): what cameras that see no patterns, such as thermal ones, show at each point of the main cloud.
  Expected<void> map_images(const std::vector<std::string>& stations);

  Reconstruction reconstruction;
  std::vector<NamedCloud> clouds;
  std::vector<ComparedRig> compared;
  CloudUncertainty uncertainty;  // of the main cloud

 private:
  std::optional<StationPlace> station_place() const;
  Expected<std::vector<StationCloud>> reconstruct(const std::string& station, const SensorPair& pair);
  Expected<void> add_compared(const std::string& station, const SensorPair& of, const StationReadings& readings,
                              const StationOptions& options);

  const Capture& capture_;
  const Rig& rig_;
  const ReconstructorOptions& options_;
  bool tracked_;
  NearPoses near_;
  std::map<std::string, StationPose> refined_;
  std::map<std::string, Pose> places_;                        // world_from_probe of a tracked probe
  std::vector<std::pair<std::string, Constellation>> posed_;  // of a probe that is tracked by pixels
  Expected<StationPose> where_ = StationPose{};
};

}  // namespace crumple
