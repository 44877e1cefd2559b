#include "datasets/report/validation_section.h"

#include <fmt/format.h>

#include "datasets/report/html.h"

namespace crumple {
namespace {

std::vector<std::string> held_out_row(const HeldOutBoard& board, const std::string& name,
                                      const std::string& diagonals) {
  return {name,
          html_number(board.points),
          html_number(board.kept_of_white, fmt::format("{:.1f} %", 100 * board.kept_of_white)),
          html_number(board.dense_plane_rms_mm, 4),
          html_number(board.dense_plane_rms_untrimmed_mm, 4),
          html_number(board.trimmed_share, fmt::format("{:.2f} %", 100 * board.trimmed_share)),
          html_number(board.dense_shape_rms_mm, 4),
          html_number(board.corner_plane_rms_mm, 4),
          html_number(board.pitch_rms_mm, 4),
          diagonals,
          html_number(board.mean_sigma_mm, 4)};
}

std::string signed_mm(double value) { return html_number(value, fmt::format("{:+.3f}", value)); }

}  // namespace

std::string validation_section(const CrossValidation& validation) {
  std::vector<std::vector<std::string>> rows;
  for (const HeldOutBoard& board : validation.boards) {
    rows.push_back(held_out_row(board, html_text(board.station),
                                signed_mm(board.diagonal_error_mm[0]) + " " + signed_mm(board.diagonal_error_mm[1])));
  }
  rows.push_back(held_out_row(validation.mean, "mean", html_number(validation.mean.diagonal_error_mm[0], 3)));
  return "<section id=\"validation\">\n<h2>Cross-validation</h2>\n<p>Each placement measured by a rig that has not "
         "seen "
         "it, in mm. The mean of the diagonals is of magnitudes. Decoding is the mean sigma that decoding alone "
         "predicts.</p>\n" +
         html_table({{"Left out", true},
                     {"Points"},
                     {"Of white"},
                     {"Plane RMS"},
                     {"untrimmed"},
                     {"trimmed"},
                     {"To shape"},
                     {"Corner plane"},
                     {"Pitch RMS"},
                     {"Diagonals"},
                     {"Decoding"}},
                    rows) +
         "</section>\n";
}

}  // namespace crumple
