// Whether a station's board can be found, and whether the projector lights it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "datasets/finding.h"
#include "datasets/sequence_check.h"

namespace crumple {

// Warning: the board is not found in the white (else the ambient) frame, or only a part of it beside another board, so
// this view will not be used: what a calibration says when it leaves it out.
// Error: white is not brighter than black on 95 % of the board's area, so no stripe can be decoded there.
std::vector<Finding> check_board(const std::vector<ShownFrame>& frames, const BoardSpec& board,
                                 std::size_t boards_in_view, double full_scale, const std::string& where);

}  // namespace crumple
