// From a capture on disk to what calib takes: boards detected in every image, stripes read on them.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/stripe_observations.h"
#include "datasets/capture.h"
#include "solvers/expected.h"

namespace crumple {

// A view that was not used, and why.
struct SkippedView {
  std::string station;
  std::string sensor;
  std::string reason;
  bool by_hand = false;  // excluded in capture.yaml
};

struct CalibrationInput {
  CalibrationData data;
  std::vector<std::string> stations;  // of each placement
  std::vector<BoardStripes> stripes;  // one per camera, projector and placement
  std::vector<SkippedView> skipped;
};

// What the projector is calibrated from; automatic: all of this that the capture has.
enum class ProjectorSource { automatic, stripes, chessboard };

// Sensors named in `only` (all where it is empty), cameras first. A placement is a board at a station, named after the
// station and, where the capture has several boards, the board ("07/small"). Fails on an image that cannot be read, and
// where the capture lacks the projector's source or its chessboard is found nowhere; a board that is not found, printed
// or projected, only loses its view.
Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  ProjectorSource source, int threads);

}  // namespace crumple
