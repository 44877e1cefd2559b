// How well a calibration measures what it has not seen: each board placement in turn is left out, the rig calibrated on
// the others, and the left-out board reconstructed with that rig.
//
// Dense points are all decoded pixels inside the hull of the corners, each from its own intensities. A corner's stripe
// coordinates come from a quadratic in the camera pixel fitted to the readings within 20 px of it; two rays make the
// point. Planes are trimmed at five robust sigmas; the share and the untrimmed RMS are given beside.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/stripe_observations.h"
#include "recon/station.h"

namespace crumple {

struct HeldOutBoard {
  std::string station;
  std::size_t points = 0;
  double kept_of_white = 0;  // share of the white squares' pixels (one pixel from their edges) that have a point;
                             // of all pixels inside the hull where the board is no chessboard
  double dense_plane_rms_mm = 0;
  double dense_plane_rms_untrimmed_mm = 0;
  double trimmed_share = 0;
  double dense_shape_rms_mm = 0;  // about the board's modelled shape (its warp from the other placements)
  double corner_plane_rms_mm = 0;
  double pitch_rms_mm = 0;  // nearest neighbours' distances against the board's
  std::array<double, 2> diagonal_error_mm{};
  double mean_sigma_mm = 0;  // predicted from decoding alone
};

struct CrossValidation {
  std::vector<HeldOutBoard> boards;
  HeldOutBoard mean;  // of every figure; diagonal_error_mm[0] is the mean of all magnitudes
};

// Fails where a calibration without one placement fails or a left-out board cannot be reconstructed; the error names
// the station. `report` is called after each placement.
Expected<CrossValidation> cross_validate(const CalibrationData& data, const std::vector<BoardStripes>& stripes,
                                         const CalibrationOptions& options, const StationOptions& station_options,
                                         const std::function<void()>& report);

}  // namespace crumple
