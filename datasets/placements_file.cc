#include "datasets/placements_file.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/pose_yaml.h"
#include "datasets/target_yaml.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_text.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr const char* kSchema = "crumple-placements/1";
constexpr const char* kMovedSchema = "crumple-placements/2";
constexpr double kFarthestPlacement_mm = 1e6;

PlacedBoard read_board_entry(const YamlValue& value) {
  PlacedBoard board;
  YamlMap map = value.map();
  if (const auto name = map.require("name", "of the board")) board.name = name->text();
  if (const auto target = map.require("target", "what is printed on it")) {
    YamlMap keys = target->map();
    board.target = read_target(keys);
    keys.finish();
    const bool complete = board.target.columns > 0 && board.target.pitch_mm > 0;
    if (const auto sound = checked(board.target); complete && !sound) target->problem(sound.error().message);
  }
  if (const auto warp = map.require("warp_mm", "[x, y]"))
    board.warp_mm = read_vector<2>(*warp, -kFarthestPlacement_mm, kFarthestPlacement_mm);
  if (const auto estimated = map.require("warp_estimated", "true or false"))
    board.warp_estimated = estimated->boolean();
  if (const auto scale = map.require("scale", "true over nominal lengths")) board.scale = scale->number(0.5, 2);
  map.finish();
  return board;
}

BoardPlacement read_placement(const YamlValue& value, const std::vector<PlacedBoard>& boards, bool moved) {
  BoardPlacement placement;
  YamlMap map = value.map();
  if (const auto name = map.require("name", "of the placement")) placement.name = name->text();
  if (const auto board = map.require("board", "the name of one")) {
    const std::string text = board->text();
    const auto found = std::find_if(boards.begin(), boards.end(), [&](const PlacedBoard& b) { return b.name == text; });
    if (found == boards.end()) board->problem("must be one of the boards above");
    placement.board = static_cast<std::size_t>(found - boards.begin());
  }
  if (const auto pose = map.require(moved ? "world_from_board" : "probe_from_board", "the pose")) {
    placement.world_from_board = read_pose(*pose);
  }
  map.finish();
  return placement;
}

ProbeStation read_station_entry(const YamlValue& value) {
  ProbeStation station;
  YamlMap map = value.map();
  if (const auto name = map.require("name", "of the station")) station.name = name->text();
  if (const auto pose = map.require("world_from_probe", "the pose")) station.world_from_probe = read_pose(*pose);
  map.finish();
  return station;
}

}  // namespace

Placements placements_of(const Calibration& calibration, const std::vector<BoardSpec>& boards) {
  const CalibrationState& state = calibration.bundle.state;
  Placements all;
  for (std::size_t b = 0; b < boards.size(); ++b) {
    const Board& board = state.boards[b];
    all.boards.push_back({boards[b].name, boards[b].target, board.warp_mm, calibration.warp_estimated, board.scale});
  }
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) {
    all.placements.push_back({calibration.placement_names[p], state.board_of[p], state.world_from_board[p]});
  }
  for (std::size_t s = 0; s < state.world_from_probe.size(); ++s) {
    all.stations.push_back({calibration.station_names[s], state.world_from_probe[s]});
  }
  return all;
}

std::string placements_yaml(const Placements& all) {
  std::string text = fmt::format("schema: {}\n{}\n", all.stations.empty() ? kSchema : kMovedSchema,
                                 all.boards.empty() ? "boards: []" : "boards:");
  for (const PlacedBoard& board : all.boards) {
    text +=
        fmt::format("  - name: {}\n    target: {{{}}}\n    warp_mm: [{}, {}]\n    warp_estimated: {}\n    scale: {}\n",
                    yaml_quoted(board.name), target_yaml(board.target), board.warp_mm.x(), board.warp_mm.y(),
                    board.warp_estimated, board.scale);
  }
  text += all.placements.empty() ? "placements: []\n" : "placements:\n";
  for (const BoardPlacement& placement : all.placements) {
    text += fmt::format("  - name: {}\n    board: {}\n    {}:\n{}", yaml_quoted(placement.name),
                        yaml_quoted(all.boards[placement.board].name),
                        all.stations.empty() ? "probe_from_board" : "world_from_board",
                        pose_yaml(placement.world_from_board, 6));
  }
  if (!all.stations.empty()) text += "stations:\n";
  for (const ProbeStation& station : all.stations) {
    text += fmt::format("  - name: {}\n    world_from_probe:\n{}", yaml_quoted(station.name),
                        pose_yaml(station.world_from_probe, 6));
  }
  return text;
}

Expected<Placements> parse_placements(const std::string& text, const std::string& file_name) {
  const auto root = parse_yaml(text, file_name);
  if (!root) return tl::unexpected(root.error());
  YamlProblems problems(file_name);
  Placements all;
  YamlMap map = YamlValue(*root, "", &problems).map();
  bool moved = false;
  if (const auto schema = map.require("schema", kSchema))
    moved = schema->one_of({kSchema, kMovedSchema}) == kMovedSchema;
  if (const auto boards = map.require("boards", "the list of boards")) {
    for (const YamlValue& board : boards->list()) all.boards.push_back(read_board_entry(board));
  }
  if (const auto placements = map.require("placements", "the list of placements")) {
    for (const YamlValue& placement : placements->list()) {
      all.placements.push_back(read_placement(placement, all.boards, moved));
    }
  }
  if (const auto stations = moved ? map.require("stations", "the list of stations") : std::nullopt) {
    for (const YamlValue& station : stations->list()) all.stations.push_back(read_station_entry(station));
  }
  map.finish();
  if (auto error = problems.error()) return tl::unexpected(*error);
  return all;
}

}  // namespace crumple
