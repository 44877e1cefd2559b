// Drawings by gnuplot, as SVG that stands in an HTML page.
//
// gnuplot (Debian's gnuplot-nox, 5.4) runs as a child process without a shell, with its commands in a file of memory
// and none of the user's settings. The same commands give the same bytes. Commands may hold no text of a user's but
// through gnuplot_text: a backquote outside of single quotes would run a program.
#pragma once

#include <string>
#include <vector>

#include "solvers/expected.h"

namespace crumple {

struct Plot {
  int width_px = 0;  // of the drawing's own coordinates; a page scales it
  int height_px = 0;
  std::string commands;  // between `set output` and the end of the picture
};

// One SVG element per plot, in their order, by one run of gnuplot. Identifiers are different in all of them. Fails
// where gnuplot cannot be run or refuses a command.
Expected<std::vector<std::string>> draw_plots(const std::vector<Plot>& plots);

// A string in single quotes for gnuplot, which takes it literally.
std::string gnuplot_text(const std::string& text);

// "$name << EOD" with one line per row; a number that is not finite is a gap.
std::string gnuplot_data(const std::string& name, const std::vector<std::vector<double>>& rows);

}  // namespace crumple
