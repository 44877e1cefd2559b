#include "cli/calibration_input.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "calib/detect_board.h"
#include "cli/progress.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

// One camera at one station.
struct Sight {
  std::size_t sensor = 0;
  std::string station;
  std::optional<DetectedBoard> board;
  std::string reason;  // why there is none
  std::optional<std::string> error;
};

Expected<std::vector<SensorSpec>> chosen_sensors(const Capture& capture, const std::vector<std::string>& only) {
  for (const std::string& name : only) {
    if (capture.sensor(name) == nullptr) {
      return fail(fmt::format("{} has no sensor '{}'", capture.description.string(), name));
    }
  }
  std::vector<SensorSpec> sensors;
  for (const CaptureSensor& sensor : capture.sensors) {
    const bool chosen = only.empty() || std::find(only.begin(), only.end(), sensor.name) != only.end();
    if (chosen) sensors.push_back({sensor.name, sensor.kind, sensor.size, sensor.lens_model});
  }
  std::stable_partition(sensors.begin(), sensors.end(),
                        [](const SensorSpec& sensor) { return sensor.kind == SensorKind::camera; });
  return sensors;
}

void look(const Capture& capture, const SensorSpec& camera, Sight& sight) {
  const auto image = read_board_image(capture, camera.name, sight.station);
  if (!image) {
    sight.error = image.error().message;
    return;
  }
  const auto board = detect_board(*image, *capture.board);
  if (board) {
    sight.board = *board;
  } else {
    sight.reason = board.error().message;
  }
}

}  // namespace

Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  int threads) {
  if (!capture.board) {
    return fail(fmt::format("{} describes no board: a calibration needs one", capture.description.string()));
  }
  const auto sensors = chosen_sensors(capture, only);
  if (!sensors) return tl::unexpected(sensors.error());
  CalibrationInput input;
  input.data.sensors = *sensors;
  input.data.board = *capture.board;

  std::vector<Sight> sights;
  for (const Station& station : capture.stations) {
    if (!station.board) continue;
    for (std::size_t s = 0; s < sensors->size(); ++s) {
      if ((*sensors)[s].kind != SensorKind::camera) continue;
      if (const auto exclusion = capture.exclusion(station.id, (*sensors)[s].name)) {
        input.skipped.push_back({station.id, (*sensors)[s].name, exclusion->reason, true});
        continue;
      }
      sights.push_back({s, station.id, {}, {}, {}});
    }
  }
  Progress progress("detecting boards", sights.size());
  parallel_for(sights.size(), threads, [&](std::size_t i) {
    look(capture, (*sensors)[sights[i].sensor], sights[i]);
    progress.advance();
  });

  std::map<std::string, std::size_t> placements;
  for (const Sight& sight : sights) {
    const std::string& name = (*sensors)[sight.sensor].name;
    if (sight.error) return fail(*sight.error);
    if (!sight.board) {
      input.skipped.push_back({sight.station, name, sight.reason, false});
      continue;
    }
    const auto [placement, is_new] = placements.try_emplace(sight.station, input.data.placement_names.size());
    if (is_new) input.data.placement_names.push_back(sight.station);
    input.data.observations.corners.push_back(
        {sight.sensor, placement->second, sight.board->corners, sight.board->pixels});
  }
  input.data.observations.placement_count = input.data.placement_names.size();
  return input;
}

}  // namespace crumple
