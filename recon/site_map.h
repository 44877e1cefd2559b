// The sites of a merged cloud (recon/merge.h), found by where they lie: a voxel hash.
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace crumple {

// What one station's points say of a site.
struct StationSum {
  double information = 0;  // sum of 1 / variance
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float intensity = 0;
  float quality = 0;
  std::uint32_t points = 0;
};

struct Site {
  Eigen::Vector3d place_mm;
  Eigen::Vector3f normal;
  std::uint16_t station = 0;    // the first
  std::uint16_t view = 0;       // likewise
  std::uint16_t additions = 0;  // how many are fused in it
  std::uint64_t seen_by = 0;    // bit of the addition's number modulo 64
  std::uint32_t points = 0;
  double weight = 0;
  double noise = 0;                                    // sum of squared weight times variance from decoding
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();  // of offsets from the place
  Eigen::Vector3f normals = Eigen::Vector3f::Zero();
  float intensity = 0;
  float quality = 0;
  int next_in_cell = -1;
};

// Sites by the cell they lie in.
class SiteMap {
 public:
  explicit SiteMap(double cell_mm) : cell_mm_(cell_mm) {}

  std::vector<Site> sites;

  int add(const Site& site) {
    const int index = static_cast<int>(sites.size());
    sites.push_back(site);
    const auto [head, is_new] = heads_.try_emplace(key(cell(site.place_mm)), index);
    if (!is_new) sites.back().next_in_cell = std::exchange(head->second, index);
    return index;
  }

  // Calls visit(index) for every site within a box about the place, and for some beside it.
  template <typename Visit>
  void near(const Eigen::Vector3d& place_mm, double reach_mm, const Visit& visit) const {
    const Eigen::Vector3i low = cell(place_mm.array() - reach_mm), high = cell(place_mm.array() + reach_mm);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          const auto head = heads_.find(key({x, y, z}));
          if (head == heads_.end()) continue;
          for (int i = head->second; i >= 0; i = sites[i].next_in_cell) visit(i);
        }
      }
    }
  }

 private:
  Eigen::Vector3i cell(const Eigen::Vector3d& place_mm) const {
    return (place_mm / cell_mm_).array().floor().matrix().cast<int>();
  }
  // 21 bits an axis: two million cells, some kilometres.
  static std::uint64_t key(const Eigen::Vector3i& cell) {
    const auto bits = [](int value) { return static_cast<std::uint64_t>(value) & 0x1fffffU; };
    return bits(cell.x()) | bits(cell.y()) << 21U | bits(cell.z()) << 42U;
  }

  double cell_mm_;
  std::unordered_map<std::uint64_t, int> heads_;
};

}  // namespace crumple
