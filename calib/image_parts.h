// An image in nine named parts, thirds by thirds: "upper left", "top" ... row by row.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include "solvers/lens.h"

namespace crumple {

inline constexpr int kImageThirds = 3;
inline constexpr std::array<const char*, kImageThirds * kImageThirds> kImagePartNames{
    "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};

// Pixels outside of the image count to the part next to them.
inline std::size_t image_part(const Eigen::Vector2d& pixel, ImageSize size) {
  const auto third = [](double place, int of) {
    return std::clamp(static_cast<int>(std::floor(kImageThirds * (place + 0.5) / of)), 0, kImageThirds - 1);
  };
  return static_cast<std::size_t>(kImageThirds * third(pixel.y(), size.height_px) + third(pixel.x(), size.width_px));
}

}  // namespace crumple
