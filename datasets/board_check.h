// Whether a station's board can be found, and whether the projector lights it.
#pragma once

#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "datasets/finding.h"
#include "datasets/sequence_check.h"

namespace crumple {

// Warning: the board is not found in the white (else the ambient) frame, so this view will not be used.
// Error: white is not brighter than black on 95 % of the board's area, so no stripe can be decoded there.
std::vector<Finding> check_board(const std::vector<ShownFrame>& frames, const BoardSpec& board, double full_scale,
                                 const std::string& where);

}  // namespace crumple
