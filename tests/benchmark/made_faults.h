// Campaigns of a tracked system with one fault made in each, at observation level, and the words that name it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

enum class Fault {
  none,
  board_warp,      // by 0.2 mm from its plane: a bow, or a shape of second and third degree
  wrong_pitch,     // by 0.15 to 0.3 %
  polarity,        // a gamma without inverse patterns: edges off by 0.15 to 0.4 px to opposite sides
  swapped_axes,    // columns and rows of the projector
  bad_view,        // corners of one view with eight times the noise, or read one square off
  moved_led,       // by 0.3 mm between calibration and a later capture
  nudged_tracker,  // by 0.3 to 1 mm and 0.01 to 0.04 deg within the campaign
  lost_sync,       // at one to three stations patterns are taken one frame late
  too_few_tilts,
};

const std::vector<Fault>& all_faults();
const char* name_of(Fault fault);

struct FaultyCampaign {
  CalibrationData data;
  // Of moved_led: seen later, to be held against the rig of `data`.
  std::optional<CalibrationData> later = {};
  std::vector<std::string> named_by;  // a reason or note that holds one of these names it
  double stretch = 0;                 // of wrong_pitch: by how much, as a share
  double moved_mm = 0;                // of moved_led
};

// Random system, geometry and noise by the seed.
FaultyCampaign make_faulty(Fault fault, unsigned seed);

}  // namespace crumple
