#include "calib/calibration_data.h"

namespace crumple {

std::vector<Board> nominal_boards(const CalibrationData& data) {
  std::vector<Board> boards;
  for (const BoardSpec& spec : data.boards) {
    boards.push_back(board_of(spec.target, spec.name));
    if (spec.certificate) {
      boards.back().scale = scale_prior(*spec.certificate, spec.target.pitch_mm, data.temperature).scale;
    }
  }
  return boards;
}

}  // namespace crumple
