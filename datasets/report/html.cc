#include "datasets/report/html.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace crumple {
namespace {

// A lab report: one column, black on white, the same on paper.
constexpr const char* kStyle = R"(
:root { font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", "Helvetica Neue", sans-serif; color: #111; background: #fff; }
body { max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; padding-top: .5rem; border-top: 1px solid #999; }
h3 { font-size: 1.05rem; margin: 1.4rem 0 .4rem; }
ul.pairs { columns: 2; max-width: none; font-size: .87rem; }
p, ul { margin: .5rem 0; max-width: 52rem; }
.subtitle { color: #444; margin: 0 0 1rem; }
.verdict { border: 2px solid #111; padding: .6rem 1rem; margin: 1rem 0; max-width: none; }
.verdict > strong { font-size: 1.2rem; }
table { border-collapse: collapse; margin: .6rem 0; font-size: .87rem; }
caption { text-align: left; font-weight: 600; padding: .5rem 0 .2rem; }
th, td { padding: .15rem .6rem; text-align: right; border-bottom: 1px solid #ddd; vertical-align: top;
  font-variant-numeric: tabular-nums; }
thead th { border-bottom: 1.5px solid #111; vertical-align: bottom; white-space: nowrap; }
th.text, td.text { text-align: left; }
tr.part th { text-align: left; padding-top: .6rem; border-bottom: 1px solid #777; break-after: avoid; }
table.lines th { text-align: left; font-weight: 600; white-space: nowrap; }
table.lines td { text-align: left; overflow-wrap: anywhere; }
td.text { overflow-wrap: break-word; }
figure { display: inline-block; vertical-align: top; width: calc(50% - 1.2rem); margin: .3rem 1rem .7rem 0; }
figure.wide { width: 100%; margin-right: 0; }
figure svg { width: 100%; height: auto; display: block; }
figure image { image-rendering: pixelated; }
figcaption { font-size: .85rem; color: #333; }
code { font: .8em ui-monospace, "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
@media (max-width: 46rem) { figure { width: 100%; } ul.pairs { columns: 1; } }
@page { size: A4; margin: 14mm 13mm 16mm; }
@media print {
  :root { font-size: 9.6pt; orphans: 1; widows: 1; }
  body { max-width: none; margin: 0; padding: 0; }
  h2 { margin-top: 1.2rem; }
  h2, h3, caption { break-after: avoid; }
  figure, tr, .verdict, ul { break-inside: avoid; }
  #rig { break-inside: avoid; }
  thead { display: table-header-group; }
}
)";

// Decimals for two significant digits; none where the number is no positive one.
int decimals_for(double u) { return u > 0 && std::isfinite(u) ? 1 - static_cast<int>(std::floor(std::log10(u))) : 0; }

constexpr int kMostDecimals = 8;

std::string class_of(const HtmlColumn& column) { return column.text ? " class=\"text\"" : ""; }

}  // namespace

std::string html_text(const std::string& text) {
  using nlohmann::json;
  const std::string utf8 = json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace));
  std::string escaped;
  for (const char c : utf8) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return escaped;
}

std::string html_number(double value, const std::string& shown) {
  return fmt::format("<data value=\"{}\">{}</data>", value, shown);
}

std::string html_number(double value, int decimals) {
  return html_number(value, fmt::format("{:.{}f}", value, decimals));
}

std::string html_number(std::size_t count) { return fmt::format("<data value=\"{0}\">{0}</data>", count); }

std::string html_uncertainty(double u) { return html_value(u, u); }

std::string html_value(double value, double u) {
  const int decimals = decimals_for(u);
  if (decimals <= kMostDecimals) return html_number(value, std::max(0, decimals));
  const double magnitude = std::abs(value) > 0 ? std::floor(std::log10(std::abs(value))) : 0;
  return html_number(value, fmt::format("{:.{}e}", value, std::max(1, decimals + static_cast<int>(magnitude))));
}

std::string html_table(const std::vector<HtmlColumn>& columns, const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<table>\n<thead><tr>";
  for (const HtmlColumn& column : columns) {
    html += fmt::format("<th scope=\"col\"{}>{}</th>", class_of(column), column.head);
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    if (row.size() == 1) {
      html += fmt::format("<tr class=\"part\"><th scope=\"rowgroup\" colspan=\"{}\">{}</th></tr>\n", columns.size(),
                          row.front());
      continue;
    }
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) html += fmt::format("<td{}>{}</td>", class_of(columns[c]), row[c]);
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table>\n";
}

std::string html_lines(const std::vector<HtmlLine>& lines) {
  std::string html = "<table class=\"lines\">\n<tbody>\n";
  for (const HtmlLine& line : lines) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", html_text(line.name), line.value);
  }
  return html + "</tbody>\n</table>\n";
}

std::string html_list(const std::vector<std::string>& items, bool in_columns) {
  std::string html = in_columns ? "<ul class=\"pairs\">\n" : "<ul>\n";
  for (const std::string& item : items) html += "<li>" + item + "</li>\n";
  return html + "</ul>\n";
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width\"/>\n<title>{}</title>\n<style>{}</style>\n</head>\n"
      "<body>\n{}</body>\n</html>\n",
      html_text(title), kStyle, body);
}

}  // namespace crumple
