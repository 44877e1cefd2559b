#include "datasets/residual_overlay.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "calib/grey_image.h"
#include "datasets/round_number.h"

namespace crumple {
namespace {

constexpr double kDimmed = 0.55;
constexpr double kArrowOfWidth = 1.0 / 60;
constexpr int kSubpixelBits = 4;
constexpr int kLeastWidth = 960;

// OpenCV's fixed-point pixels, for lines that begin and end between pixels.
cv::Point fixed(const Eigen::Vector2d& pixel) {
  constexpr double scale = 1 << kSubpixelBits;
  const Eigen::Vector2d bounded = pixel.cwiseMax(-1e5).cwiseMin(1e5);
  return {static_cast<int>(std::lround(scale * bounded.x())), static_cast<int>(std::lround(scale * bounded.y()))};
}

void draw_arrow(cv::Mat& canvas, const Eigen::Vector2d& from, const Eigen::Vector2d& along, const cv::Scalar& colour,
                int thickness) {
  cv::line(canvas, fixed(from), fixed(from + along), colour, thickness, cv::LINE_AA, kSubpixelBits);
  cv::circle(canvas, fixed(from), (thickness + 1) << kSubpixelBits, colour, cv::FILLED, cv::LINE_AA, kSubpixelBits);
}

}  // namespace

double enlargement_for(double sigma_px, int image_width_px) {
  return largest_round_below(std::max(kArrowOfWidth * image_width_px / std::max(sigma_px, 1e-6), 1.0));
}

cv::Mat residual_overlay(const cv::Mat& image, const std::vector<ResidualArrow>& arrows, double enlargement,
                         double typical_px, const OverlayLegend& legend) {
  const int zoom = std::max(1, kLeastWidth / std::max(1, image.cols));
  const cv::Scalar good(90, 230, 90), bad(60, 60, 255), ink(255, 255, 255), paper(0, 0, 0);
  cv::Mat canvas;
  cv::cvtColor(to_8_bit(image) * kDimmed, canvas, cv::COLOR_GRAY2BGR);
  cv::resize(canvas, canvas, {}, zoom, zoom, cv::INTER_NEAREST);
  const int thickness = std::max(1, canvas.cols / 1000);
  for (const ResidualArrow& arrow : arrows) {
    // Integers are the middles of pixels, magnified ones too.
    const Eigen::Vector2d from = zoom * (arrow.pixel.array() + 0.5) - 0.5;
    draw_arrow(canvas, from, zoom * enlargement * arrow.residual_px, arrow.accepted ? good : bad, thickness);
  }
  const double text_scale = std::max(0.4, canvas.cols / 1800.0);
  const int line_px = static_cast<int>(30 * text_scale);
  cv::rectangle(canvas, {0, 0}, {canvas.cols - 1, 2 * line_px + line_px / 2}, paper, cv::FILLED);
  const auto write = [&](const std::string& text, int line) {
    cv::putText(canvas, text, {line_px / 2, line * line_px}, cv::FONT_HERSHEY_SIMPLEX, text_scale, ink, thickness,
                cv::LINE_AA);
  };
  write(legend.title, 1);
  const std::string scale =
      fmt::format("{} x {:g}; the line is {}, {:.3f} px:", legend.arrows, enlargement, legend.typical, typical_px);
  write(scale, 2);
  const int width = cv::getTextSize(scale, cv::FONT_HERSHEY_SIMPLEX, text_scale, thickness, nullptr).width;
  draw_arrow(canvas, Eigen::Vector2d(1.3 * line_px + width, 1.75 * line_px), {zoom * enlargement * typical_px, 0}, ink,
             thickness);
  return canvas;
}

}  // namespace crumple
