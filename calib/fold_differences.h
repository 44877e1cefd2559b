// Does a calibration hang on which views it was made from by more than its uncertainty says? K-fold cross-validation of
// the whole rig, of a probe that stands still as of a tracked one.
//
// Stations of the probe are dealt out into folds, every fifth one into each and once more fifths in a row, and so are
// placements seen without a station. Each fold in turn is left out, everything refined again, to first order and
// with the calibration's own sigmas and outliers, and the rig compared with that of all views (calib/rig_difference.h):
// what each sensor sees, what pairs measure, where LEDs are. Least squares on a part of the data differs from that on
// all of them by C_part - C_all, which is what is expected (Hausman, Econometrica 46, 1978: the efficient estimate does
// not correlate with the difference). Noise that is as independent as the weights say makes RMS and expected RMS alike,
// their ratio 1. Views that contradict each other make the ratio larger: a lens that was refocused, a board that was
// bent, something that moved. Then the stated uncertainty is too small, by about that factor. A ratio of 1 says nothing
// of errors that all views have in common, such as a wrong pitch, or a lens model that is wrong for all views alike.
//
// A fold that leaves something undetermined or unseen is not compared, and says so.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct Fold {
  std::vector<std::string> left_out;  // stations and placements
  std::string not_done;               // why not; empty where it was compared
};

// What is compared: "cam0" in px over its image; "cam0 proj0", "LEDs" and "LEDs against cam0 proj0" in mm.
struct FoldedQuantity {
  std::string name;
  std::string unit;
  double rms = 0;           // of the change, over points and folds
  double expected_rms = 0;  // that noise alone would make
  double ratio = 0;
  // Of the clearest fold's change from noise alone (F; as if all sigmas were known as badly as the one known worst),
  // times the number of folds; at most 1.
  double probability = 1;
  std::size_t clearest = 0;
  double clearest_ratio = 0;  // of that fold, each direction over its own sigma
};

struct FoldDifferences {
  std::vector<Fold> folds;
  std::vector<FoldedQuantity> quantities;
  std::vector<std::string> not_compared;  // sentences
};

// How many refinements that takes, for a progress bar; 0 where there is too little to deal out: a fold wants three
// stations, or three placements seen without one, whose poses were estimated.
std::size_t fold_steps(const Observations& observations, const Calibration& calibration);

// `data` is what was calibrated, from nothing (no earlier rig). Fails where fold_steps is 0 or no fold could be
// compared. `report` is called after each refinement.
Expected<FoldDifferences> fold_differences(const CalibrationData& data, const Calibration& calibration, int threads,
                                           const std::function<void()>& report);

// Folds and quantities that were not compared, and why.
std::vector<std::string> sentences_of(const FoldDifferences& differences);

// What speaks against the calibration, in words a person can act on: quantities that a fold changed by twice what is
// expected or more, where that happens by chance less than once in a thousand calibrations.
std::vector<std::string> reasons_of(const FoldDifferences& differences);

}  // namespace crumple
