// Views that could be taken next, and what they would show.
//
// Before every camera that saw a board: the board's middle in the middles of the image's nine parts (moved inwards
// until all of it is seen), at the least, the median and the largest distance at which the camera saw it, facing the
// camera or turned by 30 degrees to either side about its vertical or its horizontal, upright as it mostly was. Of a
// camera on a probe that is moved about it is the probe that goes there, before up to three of the placements that the
// camera saw, spread over them; of others the board.
//
// Before every tracker that saw the probe's LEDs: the probe with nothing before it (a wand), the middle of its LEDs in
// the same parts of the image, at the least, the median and the largest distance at which the tracker saw them, turned
// as at the station at which the tracker saw most of them, or from there by 30 degrees about the image's vertical or
// horizontal.
//
// Seen then: every point of the board, by all cameras that saw this board in the same way and have all of it in their
// images; as many stripe readings or projected features as such views had on average, where the projector reaches; and
// the LEDs that lie in a tracker's image, seen from within 15 degrees of where a tracker saw them before.
#pragma once

#include <optional>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct ViewCandidate {
  std::size_t camera = 0;
  std::optional<std::size_t> board = {};      // none: LEDs alone are shown
  std::optional<std::size_t> placement = {};  // before which the probe is to stand; none: the board is laid down anew
  std::optional<std::size_t> like_station =
      {};                           // of LEDs alone: the station whose turn of the probe the angles go on from
  int column = 0, row = 0;          // part of the image, -1 (left, top) to 1
  double distance_mm = 0;           // of the board's or the LEDs' middle, along the camera's axis
  double about_vertical_rad = 0;    // positive: the right edge nearer
  double about_horizontal_rad = 0;  // positive: the lower edge farther
  Pose camera_from_shown;           // from the board's frame; of LEDs alone from the probe's
};

std::vector<ViewCandidate> view_candidates(const CalibrationData& data, const Calibration& calibration);

// What a candidate would show, in a state that has its new placement or station last.
struct PredictedView {
  CalibrationState state;
  Observations observations;
  BlockId pose;              // the new one
  double readings_each = 1;  // how many stripe readings one of these stands for
  double features_each = 1;
};

PredictedView predicted_view(const ViewCandidate& candidate, const CalibrationData& data,
                             const Calibration& calibration);

}  // namespace crumple
