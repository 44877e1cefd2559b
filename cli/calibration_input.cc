#include "cli/calibration_input.h"

#include <algorithm>
#include <iterator>
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

std::optional<std::size_t> index_of(const std::vector<SensorSpec>& sensors, const std::optional<std::string>& name) {
  for (std::size_t s = 0; name && s < sensors.size(); ++s) {
    if (sensors[s].name == *name) return s;
  }
  return std::nullopt;
}

Expected<BoardStripes> read_board_stripes(const Capture& capture, const CalibrationInput& input, const CornerView& view,
                                          std::size_t projector) {
  const std::string& station = input.data.placement_names[view.placement];
  const std::string& camera = input.data.sensors[view.sensor].name;
  auto images = read_stripe_images(capture, camera, station);
  if (!images) return tl::unexpected(images.error());
  auto readings = read_stripes(*images, {});
  if (!readings) return fail(fmt::format("station {}, {}: {}", station, camera, readings.error().message));
  return BoardStripes{view.sensor, projector, view.placement, std::move(*readings)};
}

// Every camera's stripes on every board it found, as observations and as the projector's start.
Expected<void> add_stripes(const Capture& capture, std::size_t projector, CalibrationInput& input) {
  Progress progress("decoding stripes", input.data.observations.corners.size());
  for (const CornerView& view : input.data.observations.corners) {
    auto stripes = read_board_stripes(capture, input, view, projector);
    if (!stripes) return tl::unexpected(stripes.error());
    const cv::Mat hull = corner_hull(view.pixels, stripes->readings.white.size());
    std::vector<StripeView> views = stripe_views(*stripes, hull, {});
    if (views.empty()) {
      return fail(
          fmt::format("station {}: {} lights none of the board in {}: aim it at the board, or exclude the station",
                      input.data.placement_names[view.placement], input.data.sensors[projector].name,
                      input.data.sensors[view.sensor].name));
    }
    input.data.pairs.push_back(pixel_pairs(*stripes, hull, {}));
    std::move(views.begin(), views.end(), std::back_inserter(input.data.observations.stripes));
    input.stripes.push_back(std::move(*stripes));
    progress.advance();
  }
  return {};
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
    if (!sight.board->even_lighting) {
      log_warning(fmt::format("station {}, {}: the lighting could not be evened out; its corners may be biased",
                              sight.station, name));
    }
    const auto [placement, is_new] = placements.try_emplace(sight.station, input.data.placement_names.size());
    if (is_new) input.data.placement_names.push_back(sight.station);
    input.data.observations.corners.push_back(
        {sight.sensor, placement->second, sight.board->corners, sight.board->pixels});
  }
  input.data.observations.placement_count = input.data.placement_names.size();
  const auto projector = index_of(*sensors, capture.projector);
  if (projector && !capture.orientations.empty()) {
    if (auto added = add_stripes(capture, *projector, input); !added) return tl::unexpected(added.error());
  }
  return input;
}

}  // namespace crumple
