// capture.yaml to Capture. Each reader below takes one key of docs/formats.md.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/capture.h"
#include "datasets/file_template.h"
#include "datasets/frame_list.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr const char* kSchema = "crumple-capture/1";

// Station names end up in file names, of images and of results.
bool is_station_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return c >= 0x20 && c != '/' && c != '\\'; });
}

// Where each camera's `files` stands, for what can only be checked once frames and stations are known.
using FilesValues = std::map<std::string, YamlValue>;

FileNaming read_naming(const std::string& camera, YamlMap& map, FilesValues& files_values) {
  FileNaming naming;
  if (const auto files =
          map.require("files", "how this camera's images are named, such as \"{sensor}/{frame:02}.png\"")) {
    naming.path_template = files->text();
    files_values.emplace(camera, *files);
    const auto parsed = FileTemplate::parse(naming.path_template);
    if (!parsed) files->problem(parsed.error().message);
  }
  if (const auto offset = map.find("frame_offset")) naming.frame_offset = offset->integer(0, 1000000);
  return naming;
}

void read_sensor(const std::string& name, const YamlValue& value, Capture& capture, FilesValues& files_values) {
  if (!is_plain_name(name)) value.problem("a sensor's name is made of letters, digits, _ and -");
  YamlMap map = value.map();
  CaptureSensor sensor;
  sensor.name = name;
  sensor.lens_model = "LENSMODEL_OPENCV5";
  if (const auto kind = map.require("kind", "camera or projector")) {
    sensor.kind = kind->one_of({"camera", "projector"}) == "camera" ? SensorKind::camera : SensorKind::projector;
  }
  sensor.size = read_size_px(map);
  if (const auto lens = map.find("lens")) {
    sensor.lens_model = lens->text();
    if (!sensor.lens_model.empty() && lens_parameter_names(sensor.lens_model).empty()) {
      lens->problem(fmt::format("must be one of {}, not `{}`", lens_model_choices(), sensor.lens_model));
    }
  }
  if (sensor.kind == SensorKind::camera) {
    capture.files[name] = read_naming(name, map, files_values);
    if (const auto colour = map.find("colour")) {
      sensor.colour = colour->one_of({"srgb", "linear"}) == "srgb" ? ColourEncoding::srgb : ColourEncoding::linear;
    }
  }
  map.finish();
  capture.sensors.push_back(sensor);
}

FilesValues read_sensors(const YamlValue& value, Capture& capture) {
  FilesValues files_values;
  YamlMap map = value.map();
  for (const auto& [name, sensor] : map.entries()) read_sensor(name, sensor, capture, files_values);
  if (capture.files.empty()) value.problem("at least one camera is needed");
  return files_values;
}

Board read_board(const YamlValue& value) {
  YamlMap map = value.map();
  Board board;
  if (const auto kind = map.require("kind", "chessboard")) kind->one_of({"chessboard"});
  std::tie(board.columns, board.rows) = read_inner_corners(map);
  if (const auto pitch = map.require("pitch_mm", "the distance between neighbouring corners")) {
    board.pitch_mm = pitch->positive_number();
  }
  map.finish();
  return board;
}

void read_patterns(const YamlValue& value, Capture& capture) {
  YamlMap map = value.map();
  std::optional<ImageSize> panel;
  if (const auto projector = map.require("projector", "the name of the sensor that shows the patterns")) {
    capture.projector = projector->text();
    const CaptureSensor* sensor = capture.sensor(*capture.projector);
    if (sensor != nullptr && sensor->kind == SensorKind::projector) {
      if (sensor->size.width_px > 0) panel = sensor->size;
    } else if (!capture.projector->empty()) {
      projector->problem(fmt::format("`{}` is not a projector under `sensors`", *capture.projector));
    }
  }
  if (const auto orientations = map.find("orientations")) {
    for (const YamlValue& item : orientations->list()) capture.orientations.push_back(read_orientation(item, panel));
  }
  if (const auto board = map.find("chessboard")) {
    capture.projected_chessboard = read_projected_chessboard(*board, panel);
  }
  map.finish();
}

Station read_station(const YamlValue& value, bool has_board) {
  Station station;
  station.board = has_board;
  if (value.is_scalar()) {
    station.id = value.text();
  } else {
    YamlMap map = value.map();
    if (const auto id = map.require("id", "the station's name")) station.id = id->text();
    if (const auto board = map.find("board")) {
      station.board = board->boolean();
      if (station.board && !has_board) board->problem("is true, but no `board` is described: add one");
    }
    if (const auto name = map.find("name_in_files")) station.name_in_files = name->text();
    map.finish();
  }
  if (!station.id.empty() && !is_station_name(station.id)) {
    value.problem("a station's id holds no slashes and is not . or ..; use `name_in_files` for folders");
  }
  return station;
}

void read_stations(const YamlValue& value, Capture& capture) {
  std::set<std::string> ids;
  std::set<std::string> names_in_files;
  for (const YamlValue& item : value.list()) {
    const Station station = read_station(item, capture.board.has_value());
    const std::string& name = station.name_in_files.empty() ? station.id : station.name_in_files;
    if (!station.id.empty() && !ids.insert(station.id).second) {
      item.problem(fmt::format("station `{}` is listed twice", station.id));
    } else if (!name.empty() && !names_in_files.insert(name).second) {
      item.problem(fmt::format("`{}` stands for another station's files already", name));
    }
    capture.stations.push_back(station);
  }
  if (capture.stations.empty()) value.problem("at least one station is needed");
}

Exclusion read_exclusion(const YamlValue& value, const Capture& capture) {
  YamlMap map = value.map();
  Exclusion exclusion;
  if (const auto station = map.require("station", "the id of the station to leave out")) {
    exclusion.station = station->text();
    if (!exclusion.station.empty() && capture.station(exclusion.station) == nullptr) {
      station->problem(fmt::format("there is no station `{}`", exclusion.station));
    }
  }
  if (const auto sensor = map.find("sensor")) {
    exclusion.sensor = sensor->text();
    if (!exclusion.sensor.empty() && capture.sensor(exclusion.sensor) == nullptr) {
      sensor->problem(fmt::format("there is no sensor `{}`", exclusion.sensor));
    }
  }
  if (const auto reason = map.require("reason", "why this is left out; it goes into the report")) {
    exclusion.reason = reason->text();
  }
  map.finish();
  return exclusion;
}

void read_exclusions(const YamlValue& value, Capture& capture) {
  for (const YamlValue& item : value.list()) {
    const Exclusion exclusion = read_exclusion(item, capture);
    const auto same = [&](const Exclusion& e) {
      return e.station == exclusion.station && e.sensor == exclusion.sensor;
    };
    if (std::any_of(capture.excluded.begin(), capture.excluded.end(), same)) item.problem("is given twice: keep one");
    capture.excluded.push_back(exclusion);
  }
}

void read_frame_names(const YamlValue& value, Capture& capture) {
  for (const YamlValue& item : value.list()) capture.frame_names.push_back(item.text());
  if (capture.frame_names.size() != capture.frames.size()) {
    value.problem(fmt::format("has {} names for {} frames: give one for each, in their order, none for unused ones",
                              capture.frame_names.size(), capture.frames.size()));
  }
}

// Every image must have a name of its own.
void check_templates(const FilesValues& files_values, const Capture& capture) {
  std::set<std::string> seen;
  for (const auto& [camera, value] : files_values) {
    const FileNaming& naming = capture.files.at(camera);
    const auto parsed = FileTemplate::parse(naming.path_template);
    if (!parsed || naming.path_template.empty()) continue;
    if (capture.stations.size() > 1 && !parsed->uses("station")) {
      value.problem(
          fmt::format("lacks {{station}}, so all {} stations would read the same images", capture.stations.size()));
    }
    if (capture.frames.size() > 1 && !parsed->uses("frame") && !parsed->uses("frame_name")) {
      value.problem(fmt::format("lacks {{frame}} or {{frame_name}}, so all {} frames would read the same image",
                                capture.frames.size()));
    }
    if (parsed->uses("frame_name") && capture.frame_names.empty()) {
      value.problem("has {frame_name}: list the `frame_names`");
    }
    if (!seen.insert(parsed->expand({"*", camera, naming.frame_offset, "*"})).second) {
      value.problem("names the same images as another camera's: use {sensor}");
    }
  }
}

void read_root(const YamlValue& root, Capture& capture) {
  YamlMap map = root.map();
  if (const auto schema = map.require("schema", std::string("write `schema: ") + kSchema + "`")) {
    schema->one_of({kSchema});
  }
  if (const auto title = map.require("title", "one line that says what was captured")) capture.title = title->text();
  if (const auto images = map.find("images")) capture.images = images->text();
  const auto sensors = map.require("sensors", "the cameras and projectors, each with its kind and size");
  const FilesValues files_values = sensors ? read_sensors(*sensors, capture) : FilesValues{};
  if (const auto board = map.find("board")) capture.board = read_board(*board);
  if (const auto patterns = map.find("patterns")) read_patterns(*patterns, capture);
  if (const auto frames = map.require("frames", "what each image of a station shows, in order")) {
    read_frames(*frames, capture);
  }
  if (const auto names = map.find("frame_names")) read_frame_names(*names, capture);
  if (const auto stations = map.require("stations", "the ids of the stations, in order")) {
    read_stations(*stations, capture);
  }
  if (const auto exclude = map.find("exclude")) read_exclusions(*exclude, capture);
  check_templates(files_values, capture);
  map.finish();
}

}  // namespace

Expected<Capture> parse_capture(const std::string& text, const std::string& file_name) {
  const auto document = parse_yaml(text, file_name);
  if (!document) return tl::unexpected(document.error());
  YamlProblems problems(file_name);
  Capture capture;
  read_root(YamlValue(*document, "", &problems), capture);
  if (auto error = problems.error()) return tl::unexpected<Error>(*error);
  return capture;
}

}  // namespace crumple
