#include "datasets/report/report_figures.h"

#include <string_view>

#include <fmt/format.h>

namespace crumple {
namespace {

// No text of the report's holds a comment.
constexpr std::string_view kPlaceBegin = "<!--plot ", kPlaceEnd = "-->";

}  // namespace

std::string ReportFigures::add(Plot plot, const std::string& caption, bool wide) {
  plots_.push_back(std::move(plot));
  const std::size_t number = plots_.size();
  return fmt::format("<figure{}>{}{}{}\n<figcaption>Figure {}. {}</figcaption></figure>\n",
                     wide ? " class=\"wide\"" : "", kPlaceBegin, number, kPlaceEnd, number, caption);
}

Expected<std::string> ReportFigures::fill(const std::string& html) const {
  const auto pictures = draw_plots(plots_);
  if (!pictures) return tl::unexpected(pictures.error());
  std::string filled;
  std::size_t begin = 0;
  for (std::size_t at = 0; (at = html.find(kPlaceBegin, begin)) != std::string::npos;) {
    const std::size_t number = std::stoul(html.substr(at + kPlaceBegin.size()));
    filled += html.substr(begin, at - begin) + (*pictures)[number - 1];
    begin = html.find(kPlaceEnd, at) + kPlaceEnd.size();
  }
  return filled + html.substr(begin);
}

}  // namespace crumple
