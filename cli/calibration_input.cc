#include "cli/calibration_input.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include <fmt/format.h>

#include "calib/detect_target.h"
#include "calib/projected_board.h"
#include "cli/led_input.h"
#include "cli/progress.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

// One board in one camera at one station.
struct BoardSight {
  std::size_t board = 0;
  Expected<DetectedBoard> found;
};

// One camera at one station.
struct Sight {
  std::size_t sensor = 0;
  const Station* station = nullptr;
  std::vector<BoardSight> boards;
  std::optional<std::string> error;
};

std::optional<std::size_t> index_of(const std::vector<SensorSpec>& sensors, const std::optional<std::string>& name) {
  for (std::size_t s = 0; name && s < sensors.size(); ++s) {
    if (sensors[s].name == *name) return s;
  }
  return std::nullopt;
}

Expected<std::vector<SensorSpec>> chosen_sensors(const Capture& capture, const std::vector<std::string>& only) {
  for (const std::string& name : only) {
    if (capture.sensor(name) == nullptr) {
      return fail(fmt::format("{} has no sensor '{}'", capture.description.string(), name));
    }
  }
  std::vector<SensorSpec> sensors;
  for (const CaptureSensor& sensor : capture.sensors) {
    const bool chosen = only.empty() || std::find(only.begin(), only.end(), sensor.name) != only.end();
    if (chosen) sensors.push_back({sensor.name, sensor.kind, sensor.size, sensor.lens_model, sensor.mount});
  }
  std::stable_partition(sensors.begin(), sensors.end(),
                        [](const SensorSpec& sensor) { return sensor.kind == SensorKind::camera; });
  for (SensorSpec& sensor : sensors) {
    const std::string& owner = capture.sensor(sensor.name)->lens_of;
    if (owner.empty()) continue;
    sensor.lens_of = index_of(sensors, owner);
    if (!sensor.lens_of) {
      return fail(
          fmt::format("--sensors: {} is {} moved, whose lens only that one tells: add {}", sensor.name, owner, owner));
    }
  }
  return sensors;
}

void look(const Capture& capture, const SensorSpec& camera, Sight& sight) {
  const auto image = read_board_image(capture, camera.name, sight.station->id);
  if (!image) {
    sight.error = image.error().message;
    return;
  }
  for (const std::size_t board : sight.station->boards) {
    sight.boards.push_back(
        {board, detect_target_among(*image, capture.boards[board].target, sight.station->boards.size())});
  }
}

// Before the probe alone a board is somewhere else at each station, wherever it stays in the world.
std::string placement_name(const Capture& capture, const Station& station, std::size_t board,
                           const std::vector<SensorSpec>& sensors) {
  const bool in_world =
      std::any_of(sensors.begin(), sensors.end(), [](const SensorSpec& s) { return s.mount == Mount::world; });
  const std::string& place = station.placement.empty() || !in_world ? station.id : station.placement;
  return capture.boards.size() > 1 ? place + "/" + capture.boards[board].name : place;
}

// Whether the probe is moved about: sensors in the world watch it.
bool is_tracked(const std::vector<SensorSpec>& sensors) {
  const auto is_on = [&](Mount mount) {
    return std::any_of(sensors.begin(), sensors.end(), [&](const SensorSpec& s) { return s.mount == mount; });
  };
  return is_on(Mount::world) && is_on(Mount::probe);
}

Expected<BoardStripes> read_board_stripes(const Capture& capture, const CalibrationInput& input, const CornerView& view,
                                          const std::string& station, std::size_t projector) {
  const std::string& camera = input.data.sensors[view.sensor].name;
  auto images = read_stripe_images(capture, camera, station);
  if (!images) return tl::unexpected(images.error());
  auto readings = read_stripes(*images, {});
  if (!readings) return fail(fmt::format("station {}, {}: {}", station, camera, readings.error().message));
  return BoardStripes{view.sensor, projector, view.placement, std::move(*readings)};
}

// Every camera's stripes on every board it found, as observations and as the projector's start.
Expected<void> add_stripes(const Capture& capture, CalibrationInput& input) {
  Progress progress("decoding stripes", input.data.observations.corners.size());
  for (std::size_t i = 0; i < input.data.observations.corners.size(); ++i) {
    const CornerView& view = input.data.observations.corners[i];
    progress.advance();
    if (!capture.sees_patterns(input.data.sensors[view.sensor].name)) continue;
    const auto projector = index_of(input.data.sensors, capture.projector_at(input.corner_stations[i]));
    if (!projector) continue;
    auto stripes = read_board_stripes(capture, input, view, input.corner_stations[i], *projector);
    if (!stripes) return tl::unexpected(stripes.error());
    const cv::Mat hull = corner_hull(view.pixels, stripes->readings.white.size());
    std::vector<StripeView> views = stripe_views(*stripes, hull, {});
    if (views.empty()) {
      return fail(fmt::format(
          "station {}: {} lights none of the board in {}: aim it at the board, or exclude the station",
          input.corner_stations[i], input.data.sensors[*projector].name, input.data.sensors[view.sensor].name));
    }
    input.data.pairs.push_back(pixel_pairs(*stripes, hull, {}));
    input.data.pairs.back().station = view.station;
    for (StripeView& stripe_view : views) stripe_view.station = view.station;
    std::move(views.begin(), views.end(), std::back_inserter(input.data.observations.stripes));
    input.stripes.push_back(std::move(*stripes));
  }
  return {};
}

// An optional frame: empty where the capture has none.
Expected<cv::Mat> read_optional_frame(const Capture& capture, const std::string& camera, const std::string& station,
                                      FrameContent::Kind kind) {
  const auto frame = capture.find_frame(kind);
  if (!frame) return cv::Mat();
  return read_frame(capture, camera, station, *frame);
}

Expected<ProjectedBoardImages> read_projected_board_images(const Capture& capture, const std::string& camera,
                                                           const std::string& station) {
  auto chessboard = read_lit_frame(capture, camera, station, *capture.find_frame(FrameContent::Kind::chessboard));
  if (!chessboard) return tl::unexpected(chessboard.error());
  auto white = read_optional_frame(capture, camera, station, FrameContent::Kind::white);
  if (!white) return tl::unexpected(white.error());
  auto black = read_optional_frame(capture, camera, station, FrameContent::Kind::black);
  if (!black) return tl::unexpected(black.error());
  return ProjectedBoardImages{*chessboard, *white, *black};
}

// The projected chessboard of one camera and placement.
struct ProjectedSight {
  Expected<ProjectedCorners> corners;
  std::optional<std::string> error;  // of reading the images
};

ProjectedSight look_for_projected(const Capture& capture, const CalibrationInput& input, std::size_t corner_view) {
  const CornerView& view = input.data.observations.corners[corner_view];
  const auto images =
      read_projected_board_images(capture, input.data.sensors[view.sensor].name, input.corner_stations[corner_view]);
  if (!images) return {fail(images.error().message), images.error().message};
  const Target& print = input.data.boards[input.data.board_of[view.placement]].target;
  return {detect_projected_board(*images, *capture.projected_chessboard, print, view), {}};
}

// Every camera's projected corners on every plate whose print it found, as observations and as the projector's start.
Expected<void> add_projected_boards(const Capture& capture, int threads, CalibrationInput& input) {
  const std::vector<CornerView>& printed = input.data.observations.corners;
  std::vector<std::optional<ProjectedSight>> sights(printed.size());
  Progress progress("detecting the projected chessboard", printed.size());
  parallel_for(printed.size(), threads, [&](std::size_t i) {
    const bool lit = index_of(input.data.sensors, capture.projector_at(input.corner_stations[i])).has_value();
    if (lit && capture.sees_patterns(input.data.sensors[printed[i].sensor].name)) {
      sights[i] = look_for_projected(capture, input, i);
    }
    progress.advance();
  });
  for (std::size_t i = 0; i < printed.size(); ++i) {
    const CornerView& view = printed[i];
    if (!sights[i]) continue;
    if (sights[i]->error) return fail(*sights[i]->error);
    const Expected<ProjectedCorners>& found = sights[i]->corners;
    if (!found) {
      input.skipped.push_back(
          {input.corner_stations[i], input.data.sensors[view.sensor].name, found.error().message, false});
      continue;
    }
    const std::size_t projector = *index_of(input.data.sensors, capture.projector_at(input.corner_stations[i]));
    input.data.pairs.push_back(
        {view.sensor, projector, view.placement, found->camera_pixels, found->projector_pixels, view.station});
    input.data.observations.features.push_back(
        {projector, view.sensor, view.placement, found->projector_pixels, found->camera_pixels, view.station});
    input.feature_stations.push_back(input.corner_stations[i]);
  }
  if (input.data.observations.features.empty() && !input.skipped.empty()) {
    const SkippedView& last = input.skipped.back();
    return fail(fmt::format("{}: its chessboard was found at no station; station {}, {}: {}", *capture.projector,
                            last.station, last.sensor, last.reason));
  }
  return {};
}

// Everything projectors are calibrated from. Nothing where there is none among the sensors.
Expected<void> add_projector(const Capture& capture, ProjectorSource source, int threads, CalibrationInput& input) {
  const bool has_stripes = !capture.orientations.empty();
  const bool has_chessboard = capture.find_frame(FrameContent::Kind::chessboard) && capture.projected_chessboard;
  if (source == ProjectorSource::stripes && !has_stripes) {
    return fail(
        fmt::format("{} describes no stripe patterns to calibrate the projector from", capture.description.string()));
  }
  if (source == ProjectorSource::chessboard && !has_chessboard) {
    return fail(
        fmt::format("{} has no chessboard frame to calibrate the projector from: list it in `frames`, and "
                    "describe it under `patterns.chessboard`",
                    capture.description.string()));
  }
  const bool any = std::any_of(input.data.sensors.begin(), input.data.sensors.end(),
                               [](const SensorSpec& sensor) { return sensor.kind == SensorKind::projector; });
  if (!any || !capture.projector) return {};
  if (has_stripes && source != ProjectorSource::chessboard) {
    if (auto added = add_stripes(capture, input); !added) return added;
  }
  if (has_chessboard && source != ProjectorSource::stripes) {
    return add_projected_boards(capture, threads, input);
  }
  return {};
}

// A board that one camera found, as an observation of its placement; or the reason why it is left out.
void add_corners(const Capture& capture, const Sight& sight, const BoardSight& seen, CalibrationInput& input) {
  const std::string& camera = input.data.sensors[sight.sensor].name;
  const std::string name = placement_name(capture, *sight.station, seen.board, input.data.sensors);
  const Expected<DetectedBoard>& found = seen.found;
  if (!found) {
    input.skipped.push_back({name, camera, found.error().message, false});
    return;
  }
  if (found->unrefined > 0) {
    log_warning(fmt::format("station {}, {}: {} points are left out: what is seen there does not fit them", name,
                            camera, found->unrefined));
  }
  auto& names = input.data.placement_names;
  const auto known = std::find(names.begin(), names.end(), name);
  const auto placement = static_cast<std::size_t>(known - names.begin());
  if (known == names.end()) {
    names.push_back(name);
    input.data.board_of.push_back(seen.board);
  }
  std::optional<std::size_t> station;
  if (is_tracked(input.data.sensors) && input.data.sensors[sight.sensor].mount == Mount::probe) {
    station = station_number(sight.station->id, input.data);
  }
  input.data.observations.corners.push_back({sight.sensor, placement, found->corners, found->pixels, station});
  input.corner_stations.push_back(sight.station->id);
}

}  // namespace

Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  ProjectorSource source, int threads, NeedsBoards needs_boards,
                                                  const std::vector<Led>& earlier_leds) {
  if (capture.boards.empty() && needs_boards == NeedsBoards::yes) {
    return fail(fmt::format("{} describes no board: a calibration needs one", capture.description.string()));
  }
  const auto sensors = chosen_sensors(capture, only);
  if (!sensors) return tl::unexpected(sensors.error());
  CalibrationInput input;
  input.data.sensors = *sensors;
  input.data.boards = capture.boards;
  input.data.temperature = capture.record.temperature;

  std::vector<Sight> sights;
  for (const Station& station : capture.stations) {
    if (station.boards.empty()) continue;
    for (std::size_t s = 0; s < sensors->size(); ++s) {
      const std::string& name = (*sensors)[s].name;
      if ((*sensors)[s].kind != SensorKind::camera || !capture.took_images(name, station)) continue;
      const bool sees_boards =
          capture.find_frame(FrameContent::Kind::white, name) || capture.find_frame(FrameContent::Kind::ambient, name);
      if (!sees_boards && (*sensors)[s].mount == Mount::world) continue;
      if (const auto exclusion = capture.exclusion(station.id, (*sensors)[s].name)) {
        input.skipped.push_back({station.id, (*sensors)[s].name, exclusion->reason, true});
        continue;
      }
      sights.push_back({s, &station, {}, {}});
    }
  }
  Progress progress("detecting boards", sights.size());
  parallel_for(sights.size(), threads, [&](std::size_t i) {
    look(capture, (*sensors)[sights[i].sensor], sights[i]);
    progress.advance();
  });

  for (const Sight& sight : sights) {
    if (sight.error) return fail(*sight.error);
    for (const BoardSight& seen : sight.boards) add_corners(capture, sight, seen, input);
  }
  input.data.observations.placement_count = input.data.placement_names.size();
  if (auto read = read_leds(capture, earlier_leds, threads, input); !read) return tl::unexpected(read.error());
  if (auto added = add_projector(capture, source, threads, input); !added) return tl::unexpected(added.error());
  return input;
}

}  // namespace crumple
