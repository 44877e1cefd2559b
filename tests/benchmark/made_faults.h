// Campaigns of a tracked system with one fault made in each, at observation level, and the words that name it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

enum class Fault {
  none,
  board_warp,              // by 0.2 mm from its plane: a bow, or a shape of second and third degree
  wrong_pitch,             // of one of two boards, by 0.15 to 0.3 %
  wrong_pitch_one_board,   // the same where nothing else could tell: no other board, no bar
  wrong_pitch_beside_bar,  // of one of two boards beside a scale bar, by 0.3 to 4 %
  polarity,                // a gamma without inverse patterns: edges off by 0.15 to 0.4 px to opposite sides
  swapped_axes,            // columns and rows of the projector
  bad_view,                // corners of one view with eight times the noise, or read one square off
  moved_led,               // by 0.3 mm between calibration and a later capture
  nudged_tracker,          // by 0.3 to 1 mm and 0.01 to 0.04 deg within the campaign
  lost_sync,               // at one to three stations each pattern from some one on shows the one before
  too_few_tilts,
};

const std::vector<Fault>& all_faults();
const char* name_of(Fault fault);

// A regular expression for what is said of such a fault of a part: a board, an LED, a tracker or a station, itself an
// expression. What only states a limit ("a wrong pitch would show from 0.1 % on") does not match.
std::string said_of(Fault fault, const std::string& part = ".*");

// Whether a sentence names a fault of any kind, of whatever part.
bool names_a_fault(const std::string& sentence);

// Whether it names several parts of which one is at fault.
bool names_one_of_several(const std::string& sentence);

struct FaultyCampaign {
  CalibrationData data;
  // Of moved_led and none: seen later, to be held against the rig of `data`.
  std::optional<CalibrationData> later = {};
  // Named is the fault where each of these expressions is found in some reason or note. None: nothing could name it.
  std::vector<std::string> named_by;
  double stretch = 0;   // of a wrong pitch of board 'board': by how much, as a share
  double moved_mm = 0;  // of moved_led
  std::string moved_led;
};

// Random system, geometry and noise by the seed. Every second sound campaign has a scale bar.
FaultyCampaign make_faulty(Fault fault, unsigned seed);

}  // namespace crumple
