#include "datasets/formats/mrcal_rig.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/cameramodel_file.h"
#include "datasets/formats/foreign_rig.h"
#include "datasets/formats/mrcal_inputs.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

std::string unit_name(double mm_per_unit) {
  if (mm_per_unit == 1) return "mm";
  return mm_per_unit == 1000 ? "m" : fmt::format("{} mm", mm_per_unit);
}

}  // namespace

Expected<std::vector<std::string>> write_mrcal_rig(const RigToExport& source, const fs::path& folder) {
  const Rig rig = scaled(source.rig, 1 / source.mm_per_unit);
  const auto inputs = mrcal_inputs(source);
  int camera = 0;
  for (const Sensor& sensor : rig.sensors) {
    CameraModel model{sensor.lens, sensor.sensor_from_mount};
    if (inputs && sensor.kind == SensorKind::camera) model.inputs = OptimizationInputs{*inputs, camera++};
    const std::string text = cameramodel_text(model, unit_name(source.mm_per_unit));
    if (auto written = write_file(folder / (sensor.name + ".cameramodel"), text); !written) {
      return tl::unexpected(written.error());
    }
  }
  std::vector<std::string> lost = left_behind(rig, true);
  if (!inputs) lost.push_back("the optimization's inputs: " + inputs.error().message);
  return lost;
}

Expected<Rig> read_mrcal_rig(const std::vector<fs::path>& inputs) {
  const auto files = files_named(inputs, ".cameramodel");
  if (!files) return tl::unexpected(files.error());
  std::vector<Sensor> sensors;
  for (const fs::path& file : *files) {
    auto model = read_cameramodel(file);
    if (!model) return tl::unexpected(model.error());
    sensors.push_back(
        {plain_name(file.stem().string()), SensorKind::camera, std::move(model->lens), model->camera_from_reference});
  }
  if (*files != inputs) std::stable_partition(sensors.begin(), sensors.end(), is_at_reference);
  return rig_from_sensors(std::move(sensors));
}

}  // namespace crumple
