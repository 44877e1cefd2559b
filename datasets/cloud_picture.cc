#include "datasets/cloud_picture.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <memory>

#include <cairo.h>
#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "datasets/cloud_splats.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

constexpr int width_px = 1600;
constexpr int height_px = 1000;
const cv::Rect scene_px(40, 110, 1330, 820);
const cv::Rect bar_px(1430, 190, 34, 620);

using Colour = std::array<double, 3>;  // red, green, blue, 0..1
constexpr Colour ink{0.90, 0.92, 0.94};
constexpr Colour faint{0.60, 0.64, 0.68};

struct SurfaceDelete {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextDelete {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

// ColorBrewer's RdBu turned round (Brewer 2003): blue below zero, light at zero, red above.
Colour diverging(double share) {
  static constexpr std::array<Colour, 9> stops{{{0.13, 0.40, 0.67},
                                                {0.26, 0.58, 0.76},
                                                {0.57, 0.77, 0.87},
                                                {0.82, 0.90, 0.94},
                                                {0.97, 0.97, 0.97},
                                                {0.99, 0.86, 0.78},
                                                {0.96, 0.65, 0.51},
                                                {0.84, 0.38, 0.30},
                                                {0.70, 0.09, 0.17}}};
  const double place = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
  const auto cell = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  const double t = place - static_cast<double>(cell);
  Colour colour;
  for (std::size_t k = 0; k < 3; ++k) colour[k] = (1 - t) * stops[cell][k] + t * stops[cell + 1][k];
  return colour;
}

Colour sequential(double share) {
  static const cv::Mat3b table = [] {
    cv::Mat1b ramp(1, 256);
    for (int i = 0; i < 256; ++i) ramp(0, i) = static_cast<std::uint8_t>(i);
    cv::Mat colours;
    cv::applyColorMap(ramp, colours, cv::COLORMAP_VIRIDIS);
    return cv::Mat3b(colours);
  }();
  const cv::Vec3b bgr = table(0, static_cast<int>(std::clamp(share, 0.0, 1.0) * 255));
  return {bgr[2] / 255.0, bgr[1] / 255.0, bgr[0] / 255.0};
}

struct Scale {
  double low = 0, high = 1;
  bool is_signed = false;

  double share(double value) const { return (value - low) / (high - low); }
  Colour colour(double value) const { return is_signed ? diverging(share(value)) : sequential(share(value)); }
};

double percentile(std::vector<float> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return static_cast<double>(*place);
}

// 1, 2 or 5 times a power of ten, at most `count` of them in the range.
double tick_step(double range, int count) {
  const double least = range / count;
  const double decade = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= least) return factor * decade;
  }
  return 10 * decade;
}

Scale scale_of(const CloudPicture& picture) {
  Scale scale{0, 1, picture.is_signed};
  std::vector<float> values = picture.values;
  if (picture.is_signed) {
    for (float& value : values) value = std::abs(value);
    scale.high = std::max(1e-9, percentile(std::move(values), 0.98));
    scale.low = -scale.high;
  } else {
    scale.low = percentile(values, 0.02);
    scale.high = std::max(percentile(values, 0.98), scale.low + 1e-9);
  }
  return scale;
}

// A lamp that grazes the surface from the upper left. Brightness follows the difference from the mean normal, so that
// shallow relief shows however the surface as a whole is turned.
class Lamp {
 public:
  explicit Lamp(const CloudImage& image) {
    double sum = 0;
    int count = 0;
    for (int y = 0; y < image.weight.rows; ++y) {
      for (int x = 0; x < image.weight.cols; ++x) {
        if (image.weight(y, x) <= 0) continue;
        sum += light(image.normal(y, x));
        ++count;
      }
    }
    mean_ = count > 0 ? sum / count : 0;
  }

  double brightness(const cv::Vec3f& normal) const {
    return std::clamp(0.84 + 1.7 * (light(normal) - mean_), 0.12, 1.0);
  }

 private:
  static double light(const cv::Vec3f& normal) {
    static const cv::Vec3f direction = cv::normalize(cv::Vec3f(-0.6F, -0.75F, -0.45F));
    return std::max(0.0F, normal.dot(direction));
  }

  double mean_ = 0;
};

std::uint32_t packed(const Colour& colour, double brightness) {
  std::uint32_t pixel = 0xff000000U;
  for (std::size_t k = 0; k < 3; ++k) {
    const double level = std::clamp(colour[k] * brightness, 0.0, 1.0);
    pixel |= static_cast<std::uint32_t>(std::lround(255 * level)) << (16 - 8 * k);
  }
  return pixel;
}

// A dark ground, a little lighter in the middle.
std::uint32_t background(int x, int y) {
  const double dx = (x - 0.45 * width_px) / width_px;
  const double dy = (y - 0.5 * height_px) / height_px;
  const double glow = std::exp(-4 * (dx * dx + dy * dy));
  return packed({0.16, 0.18, 0.21}, 0.55 + 0.45 * glow);
}

void paint_pixels(cairo_surface_t* surface, const CloudImage& image, const Scale& scale) {
  const Lamp lamp(image);
  cairo_surface_flush(surface);
  unsigned char* const data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < height_px; ++y) {
    auto* row = reinterpret_cast<std::uint32_t*>(data + static_cast<std::ptrdiff_t>(y) * stride);
    for (int x = 0; x < width_px; ++x) {
      row[x] = background(x, y);
      const cv::Point in_scene(x - scene_px.x, y - scene_px.y);
      const bool inside = in_scene.x >= 0 && in_scene.y >= 0 && in_scene.x < scene_px.width &&
                          in_scene.y < scene_px.height && image.weight(in_scene) > 0;
      if (inside)
        row[x] =
            packed(scale.colour(static_cast<double>(image.value(in_scene))), lamp.brightness(image.normal(in_scene)));
    }
  }
  cairo_surface_mark_dirty(surface);
}

void set_colour(cairo_t* context, const Colour& colour) {
  cairo_set_source_rgb(context, colour[0], colour[1], colour[2]);
}

enum class Align { left, right, centre };

void draw_text(cairo_t* context, const std::string& text, double x, double y, double size, Align align = Align::left) {
  cairo_set_font_size(context, size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  const double shift = align == Align::left ? 0 : (align == Align::right ? 1 : 0.5);
  cairo_move_to(context, x - shift * extents.x_advance, y);
  cairo_show_text(context, text.c_str());
}

void draw_titles(cairo_t* context, const CloudPicture& picture) {
  set_colour(context, ink);
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
  draw_text(context, picture.title, 48, 62, 32);
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  set_colour(context, faint);
  draw_text(context, picture.subtitle, 48, 96, 20);
}

// Numbers with as many digits as the step needs.
std::string tick_text(double value, double step, bool is_signed) {
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  if (std::abs(value) < step / 2) return fmt::format("{:.{}f}", 0.0, digits);
  return is_signed ? fmt::format("{:+.{}f}", value, digits) : fmt::format("{:.{}f}", value, digits);
}

// How the values are spread, to the left of the bar.
void draw_histogram(cairo_t* context, const CloudPicture& picture, const Scale& scale) {
  constexpr int bins = 124;
  constexpr double longest_px = 46;
  std::vector<double> counts(bins, 0);
  for (const float value : picture.values) {
    const double share = scale.share(static_cast<double>(value));
    if (share >= 0 && share < 1) ++counts[static_cast<std::size_t>(share * bins)];
  }
  const double most = std::max(1.0, *std::max_element(counts.begin(), counts.end()));
  cairo_set_source_rgba(context, ink[0], ink[1], ink[2], 0.35);
  const double step = static_cast<double>(bar_px.height) / bins;
  for (int i = 0; i < bins; ++i) {
    const double length = longest_px * counts[static_cast<std::size_t>(i)] / most;
    cairo_rectangle(context, bar_px.x - 6 - length, bar_px.y + bar_px.height - (i + 1) * step, length, step);
  }
  cairo_fill(context);
}

void draw_colour_bar(cairo_t* context, const CloudPicture& picture, const Scale& scale) {
  for (int i = 0; i < bar_px.height; ++i) {
    const double share = 1 - (i + 0.5) / bar_px.height;
    set_colour(context, scale.colour(scale.low + share * (scale.high - scale.low)));
    cairo_rectangle(context, bar_px.x, bar_px.y + i, bar_px.width, 1);
    cairo_fill(context);
  }
  set_colour(context, ink);
  cairo_set_line_width(context, 1);
  cairo_rectangle(context, bar_px.x - 0.5, bar_px.y - 0.5, bar_px.width + 1, bar_px.height + 1);
  cairo_stroke(context);
  const double step = tick_step(scale.high - scale.low, 8);
  for (double k = std::ceil(scale.low / step); k * step <= scale.high; ++k) {
    const double y = bar_px.y + bar_px.height * (1 - scale.share(k * step));
    cairo_move_to(context, bar_px.x + bar_px.width, y);
    cairo_rel_line_to(context, 7, 0);
    cairo_stroke(context);
    draw_text(context, tick_text(k * step, step, scale.is_signed), bar_px.x + bar_px.width + 13, y + 6, 18);
  }
  draw_text(context, picture.label, width_px - 40, bar_px.y - 26, 19, Align::right);
}

void draw_length(cairo_t* context, const CloudView& view) {
  const double length_mm = tick_step(300 / view.px_per_mm, 2);
  const double left = 48, y = height_px - 40;
  set_colour(context, ink);
  cairo_set_line_width(context, 3);
  cairo_move_to(context, left, y);
  cairo_rel_line_to(context, length_mm * view.px_per_mm, 0);
  cairo_stroke(context);
  draw_text(context, fmt::format("{:g} mm", length_mm), left + length_mm * view.px_per_mm / 2, y - 10, 18,
            Align::centre);
}

cairo_status_t append_png(void* text, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

CloudPicture picture_of_sigma(const Cloud& cloud, std::string title) {
  CloudPicture picture{std::move(title), fmt::format("{} points", cloud.points.size()), "sigma, mm", {}, false};
  for (const CloudPoint& point : cloud.points) picture.values.push_back(point.sigma_mm);
  return picture;
}

Expected<void> write_cloud_picture(const std::filesystem::path& file, const Cloud& cloud, const CloudPicture& picture) {
  assert(picture.values.size() == cloud.points.size());
  if (cloud.points.empty()) return fail(fmt::format("{} cannot be drawn: the cloud is empty", file.string()));
  const Scale scale = scale_of(picture);
  const CloudView view = choose_view(cloud, scene_px.size());
  const CloudImage image = splat(cloud, picture.values, view, scene_px.size());
  const std::unique_ptr<cairo_surface_t, SurfaceDelete> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px));
  if (const cairo_status_t status = cairo_surface_status(surface.get()); status != CAIRO_STATUS_SUCCESS) {
    return fail(fmt::format("{} cannot be drawn: {}", file.string(), cairo_status_to_string(status)));
  }
  paint_pixels(surface.get(), image, scale);
  const std::unique_ptr<cairo_t, ContextDelete> context(cairo_create(surface.get()));
  draw_titles(context.get(), picture);
  draw_histogram(context.get(), picture, scale);
  draw_colour_bar(context.get(), picture, scale);
  draw_length(context.get(), view);
  std::string png;
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), append_png, &png);
  if (status != CAIRO_STATUS_SUCCESS) {
    return fail(fmt::format("{} cannot be drawn: {}", file.string(), cairo_status_to_string(status)));
  }
  return write_file(file, png);
}

}  // namespace crumple
