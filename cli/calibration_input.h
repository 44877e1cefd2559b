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
  std::vector<BoardStripes> stripes;  // one per camera, projector and placement
  std::vector<SkippedView> skipped;
};

// Sensors named in `only` (all where it is empty), cameras first. Fails on an image that cannot be read; a board that
// is not found only loses its view.
Expected<CalibrationInput> read_calibration_input(const Capture& capture, const std::vector<std::string>& only,
                                                  int threads);

}  // namespace crumple
