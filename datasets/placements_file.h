// placements.yaml of a rig: the boards it was calibrated from and where they were placed. With the rig and
// residuals.csv it gives every residual anew.
//
//   schema: crumple-placements/1, or /2 where the probe was moved about
//   boards: name, target (the keys of capture.yaml), warp_mm, warp_estimated, scale (true over nominal lengths)
//   placements: name, board, probe_from_board (in /2 world_from_board)
//   stations: name, world_from_probe (in /2)
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/calibrate.h"
#include "calib/target.h"
#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

struct PlacedBoard {
  std::string name;
  Target target;
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();
  bool warp_estimated = false;
  double scale = 1;
};

struct BoardPlacement {
  std::string name;
  std::size_t board = 0;
  Pose world_from_board;  // the world is the probe's frame where there are no stations
};

struct ProbeStation {
  std::string name;
  Pose world_from_probe;
};

struct Placements {
  std::vector<PlacedBoard> boards;
  std::vector<BoardPlacement> placements;
  std::vector<ProbeStation> stations = {};
};

// `boards` are those that the calibration was made from.
Placements placements_of(const Calibration& calibration, const std::vector<BoardSpec>& boards);

// Numbers are read back exactly.
std::string placements_yaml(const Placements& placements);
Expected<Placements> parse_placements(const std::string& text, const std::string& file_name);

}  // namespace crumple
