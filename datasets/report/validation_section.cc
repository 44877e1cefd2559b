#include "datasets/report/validation_section.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

std::string folds_table(const FoldDifferences& folds) {
  std::vector<std::vector<std::string>> rows;
  for (const FoldedQuantity& quantity : folds.quantities) {
    rows.push_back({html_text(quantity.name), html_number(quantity.rms, 4), html_number(quantity.expected_rms, 4),
                    html_text(quantity.unit), html_number(quantity.ratio, fmt::format("{:.2f}", quantity.ratio)),
                    html_number(quantity.probability, fmt::format("{:.2g}", quantity.probability)),
                    html_text(fmt::format("{}", fmt::join(folds.folds[quantity.clearest].left_out, ", ")))});
  }
  std::string html = fmt::format(
      "<p>Without a fold of the views, {} folds in turn, all else being refined again, to first order: how far that "
      "changes what was found, RMS over points and folds, and how far noise alone would. A ratio well above 1 says "
      "that "
      "views contradict each other and the uncertainty is too small by about that factor; a ratio of 1 says nothing of "
      "errors that all views have in common. p is the probability of the clearest fold's change from noise alone, "
      "times "
      "the number of folds.</p>\n",
      folds.folds.size());
  html += html_table(
      {{"What", true}, {"Change"}, {"Expected"}, {"", true}, {"Ratio"}, {"p"}, {"Clearest without", true}}, rows);
  for (const std::string& sentence : sentences_of(folds)) html += "<p>" + html_text(sentence) + "</p>\n";
  return html;
}

std::string boards_table(const CrossValidation& validation) {
  std::vector<std::vector<std::string>> rows;
  for (const HeldOutBoard& board : validation.boards) {
    rows.push_back(held_out_row(board, html_text(board.station),
                                signed_mm(board.diagonal_error_mm[0]) + " " + signed_mm(board.diagonal_error_mm[1])));
  }
  rows.push_back(held_out_row(validation.mean, "mean", html_number(validation.mean.diagonal_error_mm[0], 3)));
  return "<p>Each placement measured by a rig that has not seen it, in mm. The mean of the diagonals is of magnitudes. "
         "Decoding is the mean sigma that decoding alone predicts.</p>\n" +
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
                    rows);
}

}  // namespace

std::string validation_section(const std::optional<FoldDifferences>& folds,
                               const std::optional<CrossValidation>& boards) {
  if (!folds && !boards) return "";
  return "<section id=\"validation\">\n<h2>Cross-validation</h2>\n" + (folds ? folds_table(*folds) : "") +
         (boards ? boards_table(*boards) : "") + "</section>\n";
}

}  // namespace crumple
