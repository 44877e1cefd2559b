#include "datasets/board_pdf.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <cairo-pdf.h>
#include <fmt/core.h>

#include "calib/target_print.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

constexpr double margin_mm = 10;  // what printers leave blank
constexpr double footer_mm = 18;  // scale bar and text
constexpr double points_per_mm = 72 / 25.4;
constexpr double text_height_mm = 3.2;

// Width and height of everything dark, mm.
Eigen::Vector2d pattern_size(const Target& target) {
  const auto [low, high] = TargetPrint(target).extent();
  return high - low;
}

// Wide enough for a bar worth measuring, too.
Eigen::Vector2d needed(const Target& target) {
  const Eigen::Vector2d pattern = pattern_size(target);
  return {std::max(pattern.x(), 60.0) + 2 * margin_mm, pattern.y() + 2 * margin_mm + footer_mm};
}

std::vector<PaperSize> standard_papers() {
  std::vector<PaperSize> papers;
  const std::vector<PaperSize> upright = {
      {"A4", 210, 297}, {"A3", 297, 420}, {"A2", 420, 594}, {"A1", 594, 841}, {"A0", 841, 1189}};
  for (const PaperSize& paper : upright) {
    papers.push_back({paper.name + " landscape", paper.height_mm, paper.width_mm});
    papers.push_back({paper.name + " portrait", paper.width_mm, paper.height_mm});
  }
  return papers;
}

PaperSize made_to_measure(double width_mm, double height_mm) {
  return {fmt::format("{:g} x {:g} mm", width_mm, height_mm), width_mm, height_mm};
}

std::optional<PaperSize> custom_paper(const std::string& text) {
  const char* const end = text.data() + text.size();
  double width_mm = 0, height_mm = 0;
  const auto width = std::from_chars(text.data(), end, width_mm);
  if (width.ec != std::errc() || width.ptr == end || *width.ptr != 'x') return std::nullopt;
  const auto height = std::from_chars(width.ptr + 1, end, height_mm);
  const bool sane = width_mm > 0 && height_mm > 0 && width_mm <= 5000 && height_mm <= 5000;
  if (height.ec != std::errc() || height.ptr != end || !sane) return std::nullopt;
  return made_to_measure(width_mm, height_mm);
}

struct CairoDelete {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};

cairo_status_t append_to_string(void* closure, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

// All shapes are filled at once: filled one by one, neighbours would show a seam where they meet.
void draw_target(cairo_t* context, const Target& target, double left_mm, double top_mm) {
  const TargetPrint print(target);
  const Eigen::Vector2d shift = Eigen::Vector2d(left_mm, top_mm) - print.extent().low_mm;
  for (const PrintedBox& box : print.boxes()) {
    const Eigen::Vector2d low = box.low_mm + shift, size = box.high_mm - box.low_mm;
    cairo_rectangle(context, low.x(), low.y(), size.x(), size.y());
  }
  for (const PrintedDisc& disc : print.discs()) {
    const Eigen::Vector2d centre = disc.centre_mm + shift;
    cairo_new_sub_path(context);
    cairo_arc(context, centre.x(), centre.y(), disc.radius_mm, 0, 2 * std::numbers::pi);
  }
  cairo_fill(context);
}

void draw_text(cairo_t* context, const std::string& text, double left_mm, double baseline_mm) {
  cairo_move_to(context, left_mm, baseline_mm);
  cairo_show_text(context, text.c_str());
}

double width_of(cairo_t* context, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  return extents.width;
}

// A bar with a tick every 10 mm, as long as fits, and two lines of text.
void draw_footer(cairo_t* context, const Target& target, const PaperSize& paper, double top_mm) {
  const double length_mm = std::min(200.0, std::floor((paper.width_mm - 2 * margin_mm) / 10) * 10);
  cairo_set_line_width(context, 0.2);
  cairo_move_to(context, margin_mm, top_mm);
  cairo_rel_line_to(context, length_mm, 0);
  for (int i = 0; i * 10 <= length_mm; ++i) {
    cairo_move_to(context, margin_mm + i * 10, top_mm);
    cairo_rel_line_to(context, 0, i % 5 == 0 ? 3 : 1.5);
  }
  cairo_stroke(context);
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  const std::string scale = fmt::format("Print at 100 %. The bar is {:g} mm long: measure it.", length_mm);
  const std::string what = words(target);
  cairo_set_font_size(context, text_height_mm);
  const double room_mm = paper.width_mm - 2 * margin_mm;
  const double longest_mm = std::max(width_of(context, scale), width_of(context, what));
  if (longest_mm > room_mm) cairo_set_font_size(context, text_height_mm * room_mm / longest_mm);
  draw_text(context, scale, margin_mm, top_mm + 4 + text_height_mm);
  draw_text(context, what, margin_mm, top_mm + 5 + 2.2 * text_height_mm);
}

}  // namespace

Expected<PaperSize> choose_paper(const std::string& paper, const Target& target) {
  if (const auto sound = checked(target); !sound) return tl::unexpected(sound.error());
  const Eigen::Vector2d need = needed(target);
  const auto fits = [&](const PaperSize& size) { return size.width_mm >= need.x() && size.height_mm >= need.y(); };
  const auto too_small = [&] {
    return fail(
        fmt::format("The board needs {:g} x {:g} mm of paper, which {} does not have.", need.x(), need.y(), paper));
  };
  if (const auto custom = custom_paper(paper)) return fits(*custom) ? Expected<PaperSize>(*custom) : too_small();
  bool known = paper == "auto";
  for (const PaperSize& size : standard_papers()) {
    const bool named = paper == "auto" || size.name.substr(0, 2) == paper;
    known = known || named;
    if (named && fits(size)) return size;
  }
  if (!known)
    return fail(fmt::format("{} is not a paper size: auto, A4, A3, A2, A1, A0 or millimetres such as 400x300.", paper));
  if (paper != "auto") return too_small();
  return made_to_measure(std::ceil(need.x()), std::ceil(need.y()));
}

Expected<void> write_board_pdf(const std::filesystem::path& file, const Target& target, const PaperSize& paper) {
  if (const auto sound = checked(target); !sound) return tl::unexpected(sound.error());
  std::string pdf;
  const std::unique_ptr<cairo_surface_t, CairoDelete> surface(cairo_pdf_surface_create_for_stream(
      append_to_string, &pdf, paper.width_mm * points_per_mm, paper.height_mm * points_per_mm));
  // Without this cairo states the time of day, and two runs would differ.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "1970-01-01T00:00:00Z");
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, "Calibration board");
  const std::unique_ptr<cairo_t, CairoDelete> context(cairo_create(surface.get()));
  cairo_scale(context.get(), points_per_mm, points_per_mm);
  const Eigen::Vector2d pattern = pattern_size(target);
  const double left_mm = (paper.width_mm - pattern.x()) / 2;
  const double top_mm = (paper.height_mm - footer_mm - pattern.y()) / 2;
  draw_target(context.get(), target, left_mm, top_mm);
  draw_footer(context.get(), target, paper, paper.height_mm - margin_mm - footer_mm + 4);
  cairo_show_page(context.get());
  cairo_surface_finish(surface.get());
  if (const cairo_status_t status = cairo_surface_status(surface.get()); status != CAIRO_STATUS_SUCCESS)
    return fail(fmt::format("{} could not be drawn: {}.", file.string(), cairo_status_to_string(status)));
  return write_file(file, pdf);
}

}  // namespace crumple
