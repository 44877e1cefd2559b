// capture.yaml to Capture. Each reader below takes one key of docs/formats.md.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <unordered_set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/capture.h"
#include "datasets/file_template.h"
#include "datasets/frame_list.h"
#include "datasets/target_yaml.h"
#include "datasets/tracker_yaml.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr std::size_t kMostImages = 1000000;  // of one camera

// Every version that was ever written is read. Versions add keys and change none, so a description of version 1 is one
// of version 3; it must not use the newer keys, for its version says which programs understand it.
const std::vector<std::string> kSchemas = {"crumple-capture/3", "crumple-capture/2",
                                           "crumple-capture/1"};  // the newest first

// Where each camera's `files` stands, for what can only be checked once frames and stations are known.
using FilesValues = std::map<std::string, YamlValue>;

// A key of version 3. Beside no schema at all, that is the one problem worth stating.
std::optional<YamlValue> find_new(YamlMap& map, const std::string& key, const Capture& capture) {
  auto value = map.find(key);
  if (value && capture.schema != 0 && capture.schema < 3) {
    value->problem(fmt::format("is new in {0}: write `schema: {0}`", kSchemas.front()));
  }
  return value;
}

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

// Where a camera that is moved stands after its first place: by another name, with the lens of the first.
void read_set_up(YamlMap& map, const Capture& capture, CaptureSensor& sensor) {
  if (const auto stations = find_new(map, "stations", capture)) {
    for (const YamlValue& station : stations->list()) sensor.stations.push_back(station.text());
    if (sensor.stations.empty())
      stations->problem("names no station: leave it out where the camera took images at all");
  }
  const auto lens_of = find_new(map, "lens_of", capture);
  if (!lens_of) return;
  sensor.lens_of = lens_of->text();
  const CaptureSensor* owner = capture.sensor(sensor.lens_of);
  if (sensor.mount != Mount::world)
    lens_of->problem("is for cameras fixed to the world that are moved between stations");
  if (owner == nullptr || !owner->lens_of.empty() || owner->kind != SensorKind::camera ||
      owner->mount != Mount::world) {
    return lens_of->problem(
        fmt::format("must be a camera fixed to the world that is listed before, not `{}`", sensor.lens_of));
  }
  if (owner->size != sensor.size) lens_of->problem(fmt::format("`{}` has another size_px", sensor.lens_of));
  if (owner->lens_model != sensor.lens_model) lens_of->problem(fmt::format("`{}` has another lens", sensor.lens_of));
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
  if (const auto serial = map.find("serial")) sensor.serial = serial->text();
  if (const auto lens = map.find("lens")) {
    sensor.lens_model = lens->text();
    if (!sensor.lens_model.empty() && lens_parameter_names(sensor.lens_model).empty()) {
      lens->problem(fmt::format("must be one of {}, not `{}`", lens_model_choices(), sensor.lens_model));
    }
  }
  sensor.mount = read_mount(find_new(map, "mount", capture));
  if (sensor.kind == SensorKind::camera) {
    if (const auto ambient_only = find_new(map, "ambient_only", capture)) {
      sensor.ambient_only = ambient_only->boolean();
      if (sensor.ambient_only && sensor.mount == Mount::world) {
        ambient_only->problem("is for cameras on the probe: those fixed to the world have `tracker_frames`");
      }
    }
    read_set_up(map, capture, sensor);
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

// `board`, or `boards` by their names, which must not be sensors': the estimated parameters are named after both.
void read_boards(YamlMap& root, Capture& capture) {
  const auto one = root.find("board");
  const auto many = root.find("boards");
  if (one) capture.boards.push_back(read_board(*one, "board"));
  if (!many) return;
  if (one) many->problem("stands beside `board`: name that one here, too");
  YamlMap map = many->map();
  for (const auto& [name, board] : map.entries()) {
    if (!is_plain_name(name)) board.problem("a name consists of letters, digits, _ and -");
    if (capture.sensor(name) != nullptr) board.problem(fmt::format("`{}` is a sensor's name already", name));
    capture.boards.push_back(read_board(board, name));
    for (std::size_t b = 0; b + 1 < capture.boards.size(); ++b) {
      if (share_markers(capture.boards[b].target, capture.boards.back().target)) {
        board.problem(fmt::format("has markers in common with `{}`: use another `first_id` or dictionary",
                                  capture.boards[b].name));
      }
    }
  }
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

// What the cameras fixed to the world take, and what the probe's do: each list is needed where there are such cameras.
void read_frame_lists(YamlMap& map, Capture& capture) {
  const auto any = [&](Mount mount) {
    return std::any_of(capture.sensors.begin(), capture.sensors.end(), [&](const CaptureSensor& sensor) {
      return sensor.kind == SensorKind::camera && sensor.mount == mount && !sensor.ambient_only;
    });
  };
  if (const auto leds = find_new(map, "leds", capture)) capture.leds = read_capture_leds(*leds);
  if (const auto bars = find_new(map, "scale_bars", capture)) capture.scale_bars = read_scale_bars(*bars, capture.leds);
  const auto trackers = find_new(map, "tracker_frames", capture);
  if (trackers) {
    capture.tracker_frames = read_tracker_frames(*trackers);
    if (!any(Mount::world)) trackers->problem("no camera is fixed to the world: give one `mount: world`");
  } else if (any(Mount::world)) {
    map.problem("`tracker_frames` is missing: what each image of the cameras fixed to the world shows, in order");
  }
  const auto frames = map.find("frames");
  if (frames) {
    read_frames(*frames, capture);
  } else if (any(Mount::probe) || capture.files.empty()) {
    map.problem("`frames` is missing: what each image of a station shows, in order");
  }
}

// `board: false`: none is in view; `boards: [a, b]`: only these are.
void read_boards_in_view(YamlMap& map, const Capture& capture, Station& station) {
  if (const auto board = map.find("board")) {
    const bool in_view = board->boolean();
    if (in_view && capture.boards.empty()) board->problem("is true, but no `board` is described: add one");
    if (!in_view) station.boards.clear();
  }
  const auto boards = map.find("boards");
  if (!boards) return;
  station.boards.clear();
  for (const YamlValue& item : boards->list()) {
    const std::string name = item.text();
    const auto found = std::find_if(capture.boards.begin(), capture.boards.end(),
                                    [&](const BoardSpec& board) { return board.name == name; });
    if (found == capture.boards.end()) {
      if (!name.empty()) item.problem(fmt::format("there is no board `{}`", name));
      continue;
    }
    const auto index = static_cast<std::size_t>(found - capture.boards.begin());
    if (std::find(station.boards.begin(), station.boards.end(), index) != station.boards.end()) {
      item.problem("is listed twice");
    }
    station.boards.push_back(index);
  }
}

// Each would be found twice, as either of them.
void check_told_apart(const YamlValue& value, const Capture& capture, const std::vector<std::size_t>& in_view) {
  for (std::size_t i = 0; i < in_view.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const BoardSpec &board = capture.boards[in_view[i]], &other = capture.boards[in_view[j]];
      const bool described = board.target.columns > 0;  // else that is the one problem worth stating
      if (!described || !look_alike(board.target, other.target)) continue;
      value.problem(
          fmt::format("has boards `{}` and `{}` in view, which look alike: use boards with markers, or say "
                      "with `boards` which of them is in view",
                      other.name, board.name));
    }
  }
}

// It shows the same patterns as the one under `patterns`, and so has as many pixels.
std::string read_station_projector(const YamlValue& value, const Capture& capture) {
  const std::string name = value.text();
  const CaptureSensor* sensor = capture.sensor(name);
  if (!capture.projector) {
    value.problem("needs `patterns`: what the projectors show");
  } else if (sensor == nullptr || sensor->kind != SensorKind::projector) {
    value.problem(fmt::format("`{}` is not a projector under `sensors`", name));
  } else if (const CaptureSensor* usual = capture.sensor(*capture.projector);
             usual != nullptr && usual->size != sensor->size) {
    value.problem(fmt::format("`{}` has another size than `{}`, whose patterns it shows", name, usual->name));
  }
  return name;
}

Station read_station(const YamlValue& value, const Capture& capture) {
  Station station;
  for (std::size_t b = 0; b < capture.boards.size(); ++b) station.boards.push_back(b);
  if (value.is_scalar()) {
    station.id = value.text();
  } else {
    YamlMap map = value.map();
    if (const auto id = map.require("id", "the station's name")) station.id = id->text();
    read_boards_in_view(map, capture, station);
    if (const auto placement = find_new(map, "placement", capture)) station.placement = placement->text();
    if (const auto projector = find_new(map, "projector", capture)) {
      station.projector = read_station_projector(*projector, capture);
    }
    if (const auto scan = find_new(map, "scan", capture)) station.scan = scan->boolean();
    if (const auto trackers = find_new(map, "trackers", capture)) station.trackers = trackers->boolean();
    if (!station.scan && !station.trackers) map.problem("has neither a scan nor trackers: leave the station out");
    if (const auto name = map.find("name_in_files")) {
      station.name_in_files = name->text();
      if (!stays_below(station.name_in_files)) name->problem("is a path that stays below the image folder");
    }
    map.finish();
  }
  check_told_apart(value, capture, station.boards);
  if (!station.id.empty() && !is_station_name(station.id)) {
    value.problem("a station's id holds no slashes and is not . or ..; use `name_in_files` for folders");
  }
  return station;
}

void read_stations(const YamlValue& value, Capture& capture) {
  std::set<std::string> ids;
  std::set<std::string> names_in_files;
  for (const YamlValue& item : value.list()) {
    const Station station = read_station(item, capture);
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

// Stations that sensors and scale bars name.
void check_named_stations(YamlMap& map, const Capture& capture) {
  const auto check = [&](const std::string& owner, const std::vector<std::string>& stations) {
    for (const std::string& id : stations) {
      if (!id.empty() && capture.station(id) == nullptr) {
        map.problem(fmt::format("`{}` names the station `{}`, which there is not", owner, id));
      }
    }
  };
  for (const CaptureSensor& sensor : capture.sensors) check(sensor.name, sensor.stations);
  for (const CaptureBar& bar : capture.scale_bars) {
    std::set<std::string> taken;
    for (const auto& stations : bar.places) {
      check(bar.name, stations);
      for (const std::string& id : stations) {
        if (!taken.insert(id).second) map.problem(fmt::format("`{}` lies at two places at station `{}`", bar.name, id));
      }
    }
  }
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
  for (const YamlValue& item : value.list()) {
    capture.frame_names.push_back(item.text());
    if (!stays_below(capture.frame_names.back())) item.problem("is a path that stays below the image folder");
  }
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
    const std::size_t frame_count = capture.frames_of(camera).size();
    if (capture.stations.size() > 1 && !parsed->uses("station")) {
      value.problem(
          fmt::format("lacks {{station}}, so all {} stations would read the same images", capture.stations.size()));
    }
    if (frame_count > 1 && !parsed->uses("frame") && !parsed->uses("frame_name")) {
      value.problem(
          fmt::format("lacks {{frame}} or {{frame_name}}, so all {} frames would read the same image", frame_count));
    }
    if (parsed->uses("frame_name") && !capture.sees_patterns(camera)) {
      value.problem("has {frame_name}, but `frame_names` are of the probe's `frames`: use {frame}");
    } else if (parsed->uses("frame_name") && capture.frame_names.empty()) {
      value.problem("has {frame_name}: list the `frame_names`");
    }
    if (!seen.insert(parsed->expand({"*", camera, naming.frame_offset, "*"})).second) {
      value.problem("names the same images as another camera's: use {sensor}");
    }
  }
}

void read_record(YamlMap& map, CaptureRecord& record) {
  if (const auto name = map.find("operator")) record.operator_name = name->text();
  if (const auto date = map.find("date")) record.date = date->text();
  const auto sigma = map.find("temperature_sigma_k");
  if (const auto temperature = map.find("temperature_c")) {
    record.temperature = Temperature{temperature->number(-50, 150), 0};
    if (sigma) record.temperature->sigma_k = sigma->number(0, 50);
    if (!sigma) temperature->problem("needs `temperature_sigma_k`, its standard uncertainty, beside it");
  } else if (sigma) {
    sigma->problem("stands without `temperature_c`");
  }
}

// The first key of version 2 that a description uses; empty where it uses none.
std::string newer_keys(const Capture& capture) {
  const CaptureRecord& record = capture.record;
  if (!record.operator_name.empty()) return "`operator`";
  if (!record.date.empty()) return "`date`";
  if (record.temperature) return "`temperature_c`";
  for (const CaptureSensor& sensor : capture.sensors) {
    if (!sensor.serial.empty()) return "`serial`";
  }
  for (const BoardSpec& board : capture.boards) {
    if (board.name != "board") return "`boards`";
    if (board.target.kind != TargetKind::chessboard) return fmt::format("`kind: {}`", name_of(board.target.kind));
    if (board.certificate) return "`certificate`";
  }
  return {};
}

// What the templates alone do not show: "{station}{frame}" takes station 1's frame 12 for station 11's frame 2.
void check_image_names(const FilesValues& files_values, const Capture& capture) {
  std::unordered_set<std::string> seen;
  for (const auto& [camera, value] : files_values) {
    const std::size_t frame_count = capture.frames_of(camera).size();
    if (capture.stations.size() > kMostImages / frame_count) {
      return value.problem(fmt::format("stands for more than {} images: split the capture", kMostImages));
    }
    const FileNaming& naming = capture.files.at(camera);
    const FileTemplate names = *FileTemplate::parse(naming.path_template);
    for (const Station& station : capture.stations) {
      if (!capture.took_images(camera, station)) continue;
      const std::string& in_files = station.name_in_files.empty() ? station.id : station.name_in_files;
      for (std::size_t i = 0; i < frame_count; ++i) {
        const bool listed = capture.sees_patterns(camera);
        const std::string frame_name = listed && !capture.frame_names.empty() ? capture.frame_names[i] : "";
        const int number = listed ? capture.frame_numbers[i] : static_cast<int>(i);
        const std::string name = names.expand({in_files, camera, naming.frame_offset + number, frame_name});
        if (seen.insert(name).second) continue;
        return value.problem(
            fmt::format("names two images {}: set the placeholders apart, as in {{station}}_{{frame}}", name));
      }
    }
  }
}

FilesValues read_root(const YamlValue& root, Capture& capture) {
  YamlMap map = root.map();
  const auto schema = map.require("schema", "write `schema: " + kSchemas.front() + "`");
  if (schema) {
    const auto known = std::find(kSchemas.begin(), kSchemas.end(), schema->one_of(kSchemas));
    capture.schema = static_cast<int>(kSchemas.end() - known);
  }
  if (const auto title = map.require("title", "one line that says what was captured")) capture.title = title->text();
  if (const auto images = map.find("images")) capture.images = images->text();
  read_record(map, capture.record);
  const auto sensors = map.require("sensors", "the cameras and projectors, each with its kind and size");
  const FilesValues files_values = sensors ? read_sensors(*sensors, capture) : FilesValues{};
  read_boards(map, capture);
  if (const auto patterns = map.find("patterns")) read_patterns(*patterns, capture);
  read_frame_lists(map, capture);
  if (const auto names = map.find("frame_names")) read_frame_names(*names, capture);
  if (const auto stations = map.require("stations", "the ids of the stations, in order")) {
    read_stations(*stations, capture);
  }
  check_named_stations(map, capture);
  if (const auto exclude = map.find("exclude")) read_exclusions(*exclude, capture);
  check_templates(files_values, capture);
  if (schema && capture.schema == 1) {
    if (const std::string newer = newer_keys(capture); !newer.empty()) {
      schema->problem(fmt::format("has no {} yet: write `schema: {}`", newer, kSchemas.front()));
    }
  }
  map.finish();
  return files_values;
}

}  // namespace

Expected<Capture> parse_capture(const std::string& text, const std::string& file_name) {
  const auto document = parse_yaml(text, file_name);
  if (!document) return tl::unexpected(document.error());
  YamlProblems problems(file_name);
  Capture capture;
  const FilesValues files_values = read_root(YamlValue(*document, "", &problems), capture);
  if (!problems.error()) check_image_names(files_values, capture);
  if (auto error = problems.error()) return tl::unexpected<Error>(*error);
  return capture;
}

}  // namespace crumple
