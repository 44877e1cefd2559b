// A made calibration campaign of any size: cameras in a row that all see every board whole.
#pragma once

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct CampaignOptions {
  int cameras = 1;
  int boards = 60;
  int corners = 10;  // along each side
  double sigma_px = 0.1;
  const char* model = "LENSMODEL_OPENCV8";  // or _OPENCV5
  double distortion = 1;                    // times that of a real wide-angle lens
  bool warped = true;
  unsigned seed = 1;
};

struct Campaign {
  CalibrationState start;  // near the truth: 2 % off in focal length, no distortion, poses shifted
  Observations observations;
};

// 4000 x 2200 px, 1761 px of focal length, a board of 0.9 m at 1.5 to 5.6 m.
Campaign make_campaign(const CampaignOptions& options);

}  // namespace crumple
