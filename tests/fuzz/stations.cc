// A cloud's stations: stations.yaml, its two matrices and rig/ in one input, each file behind a line "=== NAME". Poses
// that are accepted are those of different stations; what is accepted with its rig can be written and comes back.
#include <cmath>
#include <set>

#include "datasets/stations_file.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const TemporaryFolder given;
  unpack(text_of(data, size), given.path());
  const auto poses = read_posed_stations(given / "stations.yaml");
  if (poses) {
    std::set<std::string> seen;
    for (const PosedStation& station : *poses) {
      const Pose& pose = station.world_from_probe;
      require(pose.translation.allFinite() && std::abs(pose.rotation.norm() - 1) < 1e-8, "poses are poses");
      require(seen.insert(station.name).second, "no two stations have one id");
    }
  }
  const auto all = read_stations(given.path());
  if (!all) {
    require(!all.error().message.empty(), "a refusal says why");
    return 0;
  }
  require(poses && poses->size() == all->poses.stations.size(), "the poses alone can be read as well");
  const TemporaryFolder written;
  const auto done = write_stations(written.path(), all->rig, all->poses);
  require(done.has_value(), "what is read can be written: " + (done ? "" : done.error().message));
  const auto again = read_stations(written.path());
  require(again.has_value(), "what is written can be read: " + (again ? "" : again.error().message));
  require(again->poses.d_rig == all->poses.d_rig && again->poses.covariance == all->poses.covariance &&
              again->poses.stations.size() == all->poses.stations.size() &&
              again->poses.views.size() == all->poses.views.size(),
          "what is written comes back the same");
  for (std::size_t i = 0; i < poses->size(); ++i) {
    const PosedStation &before = all->poses.stations[i], &after = again->poses.stations[i];
    require(after.name == before.name &&
                after.world_from_probe.rotation.coeffs() == before.world_from_probe.rotation.coeffs() &&
                after.world_from_probe.translation == before.world_from_probe.translation,
            "stations come back the same");
  }
  for (std::size_t i = 0; i < all->poses.views.size(); ++i) {
    const MeasuredView &before = all->poses.views[i], &after = again->poses.views[i];
    require(after.station == before.station && after.camera == before.camera && after.projector == before.projector &&
                after.angles_rad.size() == before.angles_rad.size(),
            "views come back the same");
  }
  return 0;
}
