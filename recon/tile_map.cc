#include "recon/tile_map.h"

#include <algorithm>
#include <cmath>

namespace crumple {

TileMap::TileMap(cv::Size image, int terms)
    : image_(image),
      terms_(terms),
      across_((image.width + kTile_px - 1) / kTile_px),
      down_((image.height + kTile_px - 1) / kTile_px),
      values_(static_cast<std::size_t>(terms * across_ * down_)) {}

cv::Rect TileMap::area(int tile) const {
  const cv::Rect whole(tile % across_ * kTile_px, tile / across_ * kTile_px, kTile_px, kTile_px);
  return whole & cv::Rect({0, 0}, image_);
}

std::span<double> TileMap::tile(int tile) {
  return std::span(values_).subspan(static_cast<std::size_t>(tile * terms_), static_cast<std::size_t>(terms_));
}

void TileMap::at(int x, int y, std::span<double> terms) const {
  const double tx = std::clamp((x + 0.5) / kTile_px - 0.5, 0.0, across_ - 1.0);
  const double ty = std::clamp((y + 0.5) / kTile_px - 0.5, 0.0, down_ - 1.0);
  const int x0 = static_cast<int>(tx);
  const int y0 = static_cast<int>(ty);
  std::fill(terms.begin(), terms.end(), 0.0);
  for (int j = y0; j <= std::min(y0 + 1, down_ - 1); ++j) {
    for (int i = x0; i <= std::min(x0 + 1, across_ - 1); ++i) {
      const double weight = (1 - std::abs(tx - i)) * (1 - std::abs(ty - j));
      const double* values = values_.data() + static_cast<std::ptrdiff_t>((j * across_ + i) * terms_);
      for (std::size_t k = 0; k < terms.size(); ++k) terms[k] += weight * values[k];
    }
  }
}

}  // namespace crumple
