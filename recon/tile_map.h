// A few numbers that vary slowly over an image: one set per square tile, bilinear between tile centres, constant beyond
// the outermost ones.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <opencv2/core/types.hpp>

namespace crumple {

class TileMap {
 public:
  static constexpr int kTile_px = 128;

  TileMap() = default;
  TileMap(cv::Size image, int terms);

  int tile_count() const { return across_ * down_; }
  int tile_of(int x, int y) const { return y / kTile_px * across_ + x / kTile_px; }
  cv::Rect area(int tile) const;
  std::span<double> tile(int tile);

  // Fills `terms` with the values at a pixel.
  void at(int x, int y, std::span<double> terms) const;

 private:
  cv::Size image_;
  int terms_ = 0;
  int across_ = 0;
  int down_ = 0;
  std::vector<double> values_;
};

}  // namespace crumple
