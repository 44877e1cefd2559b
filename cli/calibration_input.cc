#include "cli/calibration_input.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "calib/detect_board.h"
#include "calib/projected_board.h"
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

ProjectedSight look_for_projected(const Capture& capture, const CalibrationInput& input, const CornerView& view) {
  const auto images = read_projected_board_images(capture, input.data.sensors[view.sensor].name,
                                                  input.data.placement_names[view.placement]);
  if (!images) return {fail(images.error().message), images.error().message};
  return {detect_projected_board(*images, *capture.projected_chessboard, *capture.board, view), {}};
}

// Every camera's projected corners on every plate whose print it found, as observations and as the projector's start.
Expected<void> add_projected_boards(const Capture& capture, std::size_t projector, int threads,
                                    CalibrationInput& input) {
  const std::vector<CornerView>& printed = input.data.observations.corners;
  std::vector<std::optional<ProjectedSight>> sights(printed.size());
  Progress progress("detecting the projected chessboard", printed.size());
  parallel_for(printed.size(), threads, [&](std::size_t i) {
    sights[i] = look_for_projected(capture, input, printed[i]);
    progress.advance();
  });
  for (std::size_t i = 0; i < printed.size(); ++i) {
    const CornerView& view = printed[i];
    if (sights[i]->error) return fail(*sights[i]->error);
    const Expected<ProjectedCorners>& found = sights[i]->corners;
    if (!found) {
      input.skipped.push_back({input.data.placement_names[view.placement], input.data.sensors[view.sensor].name,
                               found.error().message, false});
      continue;
    }
    input.data.pairs.push_back({view.sensor, projector, view.placement, found->camera_pixels, found->projector_pixels});
    input.data.observations.features.push_back(
        {projector, view.sensor, view.placement, found->projector_pixels, found->camera_pixels});
  }
  if (input.data.observations.features.empty() && !printed.empty()) {
    return fail(fmt::format("{}: its chessboard was found at no station; station {}, {}: {}",
                            input.data.sensors[projector].name, input.data.placement_names[printed.front().placement],
                            input.data.sensors[printed.front().sensor].name, sights.front()->corners.error().message));
  }
  return {};
}

// Everything the projector is calibrated from. Nothing where there is no projector among the sensors.
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
  const auto projector = index_of(input.data.sensors, capture.projector);
  if (!projector) return {};
  if (has_stripes && source != ProjectorSource::chessboard) {
    if (auto added = add_stripes(capture, *projector, input); !added) return added;
  }
  if (has_chessboard && source != ProjectorSource::stripes) {
    return add_projected_boards(capture, *projector, threads, input);
  }
  return {};
}

}  // namespace

Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  ProjectorSource source, int threads) {
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
    if (sight.board->unrefined > 0) {
      log_warning(fmt::format("station {}, {}: {} corners are left out: no two crossing edges fit them", sight.station,
                              name, sight.board->unrefined));
    }
    const auto [placement, is_new] = placements.try_emplace(sight.station, input.data.placement_names.size());
    if (is_new) input.data.placement_names.push_back(sight.station);
    input.data.observations.corners.push_back(
        {sight.sensor, placement->second, sight.board->corners, sight.board->pixels});
  }
  input.data.observations.placement_count = input.data.placement_names.size();
  if (auto added = add_projector(capture, source, threads, input); !added) return tl::unexpected(added.error());
  return input;
}

}  // namespace crumple
