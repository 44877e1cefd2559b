// The calibration board as a PDF in true scale.
#pragma once

#include <filesystem>
#include <string>

#include "calib/target.h"
#include "solvers/expected.h"

namespace crumple {

struct PaperSize {
  std::string name;  // "A4 landscape", "400 x 300 mm"
  double width_mm = 0;
  double height_mm = 0;
};

// `paper` is "auto" (the smallest of A4 to A0, lying or upright, that takes the board, else a sheet made to measure),
// "A4" to "A0", or a size such as "400x300" in mm. Fails where the board does not fit, saying what it needs.
Expected<PaperSize> choose_paper(const std::string& paper, const Target& target);

// The target, with x to the right and y down on the sheet; below it a bar to check the printer's scale with, and what
// the board is. Same input, same bytes.
Expected<void> write_board_pdf(const std::filesystem::path& file, const Target& target, const PaperSize& paper);

}  // namespace crumple
