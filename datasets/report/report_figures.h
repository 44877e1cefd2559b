// The drawings of a report: collected while its text is written, drawn all at once, then put into the text.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "datasets/report/gnuplot.h"
#include "solvers/expected.h"

namespace crumple {

class ReportFigures {
 public:
  // A figure with its number and caption (HTML); the drawing follows in fill(). A wide one takes the page's width.
  std::string add(Plot plot, const std::string& caption, bool wide = false);

  // The text with every drawing in its place. Fails as draw_plots does.
  Expected<std::string> fill(const std::string& html) const;

 private:
  std::vector<Plot> plots_;
};

}  // namespace crumple
