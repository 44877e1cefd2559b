// HTML as text: escaped, and well-formed XML as well, so that a reader of either takes it.
#pragma once

#include <string>
#include <vector>

namespace crumple {

// Text between tags or in a quoted attribute; control characters become spaces, and what is not UTF-8 (a
// file name may hold any bytes) U+FFFD.
std::string html_text(const std::string& text);

// A number as a reader sees it, and beside it, in <data>, all of its digits.
std::string html_number(double value, const std::string& shown);
std::string html_number(double value, int decimals);
std::string html_number(std::size_t count);

// Two significant digits of a standard uncertainty, and a value to the same decimal (GUM, 7.2.6). Numbers that would
// want more than eight decimals are shown with an exponent.
std::string html_uncertainty(double u);
std::string html_value(double value, double u);

// Heads and cells are HTML; columns that are no text are numbers and stand to the right. A row of one cell is the
// heading of those below it.
struct HtmlColumn {
  std::string head;
  bool text = false;
};
std::string html_table(const std::vector<HtmlColumn>& columns, const std::vector<std::vector<std::string>>& rows);

// Name and value, line by line; values are HTML.
struct HtmlLine {
  std::string name;
  std::string value;
};
std::string html_lines(const std::vector<HtmlLine>& lines);

// Items are HTML; short ones may stand in two columns.
std::string html_list(const std::vector<std::string>& items, bool in_columns = false);

// The whole document, self-contained: no script, nothing loaded.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace crumple
