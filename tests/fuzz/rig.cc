// A rig's folder: rig.yaml, .cameramodel files and covariance.npy in one input, each behind a line "=== NAME". What is
// accepted can be written and comes back the same.
#include "datasets/rig_file.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const TemporaryFolder given;
  unpack(text_of(data, size), given.path());
  const auto rig = read_rig(given.path());
  if (!rig) return 0;
  const TemporaryFolder written;
  const auto done = write_rig(written.path(), *rig);
  require(done.has_value(), "what is read can be written: " + (done ? "" : done.error().message));
  const auto again = read_rig(written.path());
  require(again.has_value(), "what is written can be read: " + (again ? "" : again.error().message));
  require(again->sensors.size() == rig->sensors.size() && again->sigma_px == rig->sigma_px &&
              again->leds.size() == rig->leds.size() && again->covariance.names == rig->covariance.names &&
              again->covariance.matrix == rig->covariance.matrix,
          "what is written comes back the same");
  for (std::size_t i = 0; i < rig->sensors.size(); ++i) {
    const Pose& pose = rig->sensors[i].sensor_from_mount;
    require(again->sensors[i].lens.parameters() == rig->sensors[i].lens.parameters() &&
                again->sensors[i].sensor_from_mount.rotation.coeffs() == pose.rotation.coeffs() &&
                again->sensors[i].sensor_from_mount.translation == pose.translation &&
                again->sensors[i].mount == rig->sensors[i].mount,
            "sensors come back the same");
  }
  return 0;
}
