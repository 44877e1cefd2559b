#include "datasets/stations_file.h"

#include <algorithm>
#include <functional>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/npy_file.h"
#include "datasets/output_folder.h"
#include "datasets/pose_yaml.h"
#include "datasets/rig_file.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_text.h"

namespace crumple {
namespace fs = std::filesystem;
namespace {

constexpr const char* kStationsSchema = "crumple-stations/1";
constexpr const char* kDescription = "stations.yaml";
constexpr const char* kByRig = "stations_d_rig.npy";
constexpr const char* kNoise = "stations_covariance.npy";
constexpr const char* kRigFolder = "rig";
constexpr double kRadPerDegree = std::numbers::pi / 180;

std::string posed_stations_text(const Rig& rig, const StationPoses& poses) {
  std::string text =
      fmt::format("schema: {}\n{}\n", kStationsSchema, poses.stations.empty() ? "stations: []" : "stations:");
  for (const PosedStation& station : poses.stations) {
    text += fmt::format("  - id: {}\n    world_from_probe:\n{}", yaml_quoted(station.name),
                        pose_yaml(station.world_from_probe, 6));
  }
  text += poses.views.empty() ? "views: []\n" : "views:\n";
  for (const MeasuredView& view : poses.views) {
    std::vector<double> angles_deg;
    for (const double angle : view.angles_rad) angles_deg.push_back(angle / kRadPerDegree);
    text += fmt::format("  - {{station: {}, camera: {}, projector: {}, angles_deg: [{}]}}\n",
                        yaml_quoted(poses.stations[view.station].name), yaml_quoted(rig.sensors[view.camera].name),
                        yaml_quoted(rig.sensors[view.projector].name), fmt::join(angles_deg, ", "));
  }
  return text;
}

PosedStation read_posed_station(const YamlValue& value) {
  PosedStation station;
  YamlMap map = value.map();
  if (const auto id = map.require("id", "of the station")) station.name = id->text();
  if (const auto pose = map.require("world_from_probe", "its pose")) station.world_from_probe = read_pose(*pose);
  map.finish();
  return station;
}

// What stations.yaml holds whoever reads it.
std::vector<PosedStation> posed_stations(YamlMap& map) {
  std::vector<PosedStation> all;
  if (const auto schema = map.require("schema", kStationsSchema)) schema->one_of({kStationsSchema});
  const auto stations = map.require("stations", "a list");
  if (!stations) return all;
  for (const YamlValue& value : stations->list()) {
    const PosedStation station = read_posed_station(value);
    const auto same = [&](const PosedStation& s) { return s.name == station.name; };
    if (std::any_of(all.begin(), all.end(), same)) value.problem("is of a station that is there already");
    all.push_back(station);
  }
  return all;
}

std::size_t sensor_named(YamlMap& map, const std::string& key, SensorKind kind, const Rig& rig) {
  const auto name = map.require(key, "a sensor of the rig");
  if (!name) return 0;
  const auto found = rig.find(name->text());
  if (!found || rig.sensors[*found].kind != kind) name->problem("is no such sensor of the rig");
  return found.value_or(0);
}

MeasuredView read_view(const YamlValue& value, const Rig& rig, const std::vector<PosedStation>& stations) {
  MeasuredView view;
  YamlMap map = value.map();
  if (const auto id = map.require("station", "one of the stations above")) {
    const auto found =
        std::find_if(stations.begin(), stations.end(), [&](const PosedStation& s) { return s.name == id->text(); });
    if (found == stations.end()) id->problem("must be one of the stations above");
    view.station = static_cast<std::size_t>(found - stations.begin());
  }
  view.camera = sensor_named(map, "camera", SensorKind::camera, rig);
  view.projector = sensor_named(map, "projector", SensorKind::projector, rig);
  if (const auto angles = map.require("angles_deg", "of the stripe orientations that were used")) {
    for (const YamlValue& angle : angles->list()) view.angles_rad.push_back(angle.number(-360, 360) * kRadPerDegree);
    if (view.angles_rad.empty()) angles->problem("must have one at least");
  }
  map.finish();
  return view;
}

// `read_views` finds what the file says of views.
Expected<void> read_stations_yaml(const fs::path& file, std::vector<PosedStation>& stations,
                                  const std::function<void(YamlMap&)>& read_views) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto document = parse_yaml(*text, file.string());
  if (!document) return tl::unexpected(document.error());
  YamlProblems problems(file.string());
  YamlMap map(*document, "", &problems);
  stations = posed_stations(map);
  read_views(map);
  map.finish();
  if (const auto error = problems.error()) return tl::unexpected(*error);
  return {};
}

Expected<Eigen::MatrixXd> read_station_matrix(const fs::path& file, Eigen::Index rows, Eigen::Index columns) {
  auto matrix = read_npy(file);
  if (matrix && (matrix->rows() != rows || matrix->cols() != columns)) {
    return fail(fmt::format("{}: it is {} x {}, but stations and rig want {} x {}", file.string(), matrix->rows(),
                            matrix->cols(), rows, columns));
  }
  return matrix;
}

}  // namespace

Expected<void> write_stations(const fs::path& folder, const Rig& rig, const StationPoses& poses) {
  std::error_code error;
  fs::create_directory(folder / kRigFolder, error);
  if (error) return fail(fmt::format("{} could not be made: {}", (folder / kRigFolder).string(), error.message()));
  return write_rig(folder / kRigFolder, rig)
      .and_then([&] { return write_file(folder / kDescription, posed_stations_text(rig, poses)); })
      .and_then([&] { return write_npy(folder / kByRig, poses.d_rig); })
      .and_then([&] { return write_npy(folder / kNoise, poses.covariance); });
}

Expected<std::vector<PosedStation>> read_posed_stations(const fs::path& file) {
  std::vector<PosedStation> stations;
  const auto done = read_stations_yaml(file, stations, [](YamlMap& map) { map.find("views"); });
  if (!done) return tl::unexpected(done.error());
  return stations;
}

Expected<std::optional<Rig>> read_rig_of_stations(const fs::path& file) {
  const fs::path folder = file.parent_path();
  // A folder of that name alone may be any rig's.
  if (!fs::exists(folder / kByRig) || !fs::exists(folder / kRigFolder)) return std::optional<Rig>();
  auto rig = read_rig(folder / kRigFolder);
  if (!rig) return tl::unexpected(rig.error());
  return std::optional<Rig>(std::move(*rig));
}

Expected<StationsAndRig> read_stations(const fs::path& folder) {
  auto rig = read_rig(folder / kRigFolder);
  if (!rig) return tl::unexpected(rig.error());
  StationsAndRig result{std::move(*rig), {}};
  const auto read_views = [&](YamlMap& map) {
    const auto views = map.require("views", "a list");
    if (!views) return;
    for (const YamlValue& view : views->list()) {
      result.poses.views.push_back(read_view(view, result.rig, result.poses.stations));
    }
  };
  if (auto done = read_stations_yaml(folder / kDescription, result.poses.stations, read_views); !done) {
    return tl::unexpected(done.error());
  }
  const auto six = 6 * static_cast<Eigen::Index>(result.poses.stations.size());
  const auto rows = static_cast<Eigen::Index>(result.rig.covariance.names.size());
  auto by_rig = read_station_matrix(folder / kByRig, six, rows);
  if (!by_rig) return tl::unexpected(by_rig.error());
  auto noise = read_station_matrix(folder / kNoise, six, six);
  if (!noise) return tl::unexpected(noise.error());
  result.poses.d_rig = std::move(*by_rig);
  result.poses.covariance = std::move(*noise);
  return result;
}

}  // namespace crumple
