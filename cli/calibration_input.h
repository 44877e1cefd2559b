// From a capture on disk to what calib takes: boards detected in every image, stripes read on them.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/skipped_view.h"
#include "calib/stripe_observations.h"
#include "datasets/capture.h"
#include "solvers/expected.h"

namespace crumple {

struct CalibrationInput {
  CalibrationData data;
  std::vector<std::string> corner_stations;   // whose image each view of data.observations.corners is of
  std::vector<std::string> feature_stations;  // likewise of the features
  std::vector<BoardStripes> stripes;          // one per camera, projector and placement
  std::vector<SkippedView> skipped;
};

// What the projector is calibrated from; automatic: all of this that the capture has.
enum class ProjectorSource { automatic, stripes, chessboard };

// A capture without boards tells no lens, but whether a rig is still valid.
enum class NeedsBoards { yes, no };

// Sensors named in `only` (all where it is empty), cameras first. A placement is a board at a station, or at a place
// that stations share, named after the station or the place and, where the capture has several boards, the board
// ("07/small"). With sensors fixed to the world beside the probe's, stations are those of a probe that is moved about,
// and LEDs are read from the trackers' frames; lights that are no LED for sure are left out and named. Fails on an
// image that cannot be read, and where the capture lacks the projector's source or its chessboard is found nowhere; a
// board that is not found, printed or projected, only loses its view. `earlier_leds`: those of the rig that the
// calibration goes on from, which keep their places where they are not read (cli/led_input.h).
Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  ProjectorSource source, int threads,
                                                  NeedsBoards needs_boards = NeedsBoards::yes,
                                                  const std::vector<Led>& earlier_leds = {});

}  // namespace crumple
