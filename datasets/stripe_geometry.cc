#include "datasets/stripe_geometry.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr int kMiddle = 127;
constexpr int kSample = 4;      // every fourth pixel along x and y
constexpr int kNeighbour = 16;  // px over which slopes are taken
constexpr int kUnknown = -1;

// The code of each sampled pixel that is lit, else kUnknown; empty where a pattern is missing. A doubtful bit lies on a
// stripe's edge and costs one stripe at most.
cv::Mat1i decode(std::size_t orientation, int bits, const std::vector<FrameContent>& contents,
                 const SequenceStatistics& statistics) {
  cv::Mat1i gray(statistics.lit.size(), 0);
  gray.setTo(kUnknown, statistics.lit == 0);
  int used = 0;
  for (std::size_t f = 0; f < contents.size(); ++f) {
    const FrameContent& content = contents[f];
    if (content.kind != Kind::stripes || content.orientation != orientation || content.inverted) continue;
    if (statistics.scaled[f].empty()) return {};
    ++used;
    for (int y = 0; y < gray.rows; y += kSample) {
      for (int x = 0; x < gray.cols; x += kSample) {
        const bool is_lit = statistics.scaled[f](y, x) > kMiddle;
        if (gray(y, x) != kUnknown && is_lit) gray(y, x) |= 1 << (bits - 1 - content.bit);
      }
    }
  }
  if (used != bits) return {};
  for (int y = 0; y < gray.rows; y += kSample) {
    for (int x = 0; x < gray.cols; x += kSample) {
      if (gray(y, x) != kUnknown) gray(y, x) = static_cast<int>(binary_from_gray(static_cast<unsigned>(gray(y, x))));
    }
  }
  return gray;
}

StripeGeometry::Orientation measure(const cv::Mat1i& codes, const StripeOrientation& orientation, ImageSize projector) {
  StripeGeometry::Orientation result;
  const int stripes = stripe_count(orientation, projector);
  const int last = (1 << orientation.bits) - 1;
  const auto outside = [&](int code) {
    return code < orientation.code_offset || code >= orientation.code_offset + stripes;
  };
  std::size_t count = 0;
  std::size_t count_if_swapped = 0;
  for (int y = 0; y < codes.rows; y += kSample) {
    for (int x = 0; x < codes.cols; x += kSample) {
      if (codes(y, x) == kUnknown) continue;
      ++result.decoded_pixels;
      count += outside(codes(y, x)) ? 1 : 0;
      count_if_swapped += outside(last - codes(y, x)) ? 1 : 0;
    }
  }
  if (result.decoded_pixels == 0) return result;
  result.outside_share = static_cast<double>(count) / static_cast<double>(result.decoded_pixels);
  result.outside_if_swapped = static_cast<double>(count_if_swapped) / static_cast<double>(result.decoded_pixels);
  return result;
}

// The code's change over kNeighbour pixels along x and y.
std::optional<std::array<int, 2>> slope(const cv::Mat1i& codes, int y, int x) {
  const int here = codes(y, x);
  const int right = codes(y, x + kNeighbour);
  const int below = codes(y + kNeighbour, x);
  if (here == kUnknown || right == kUnknown || below == kUnknown) return {};
  return std::array<int, 2>{right - here, below - here};
}

StripeGeometry::Pair measure(const cv::Mat1i& a, const cv::Mat1i& b, double sine, int band_rows) {
  StripeGeometry::Pair pair;
  std::size_t upright = 0;
  for (int y = 0; y + kNeighbour < a.rows; y += kSample) {
    if (y % band_rows + kNeighbour >= band_rows) continue;
    for (int x = 0; x + kNeighbour < a.cols; x += kSample) {
      const auto slope_a = slope(a, y, x);
      const auto slope_b = slope(b, y, x);
      if (!slope_a || !slope_b) continue;
      const int determinant = (*slope_a)[0] * (*slope_b)[1] - (*slope_a)[1] * (*slope_b)[0];
      if (determinant == 0) continue;
      ++pair.places;
      upright += (determinant > 0) == (sine > 0) ? 1 : 0;
    }
  }
  if (pair.places > 0) pair.upright_share = static_cast<double>(upright) / static_cast<double>(pair.places);
  return pair;
}

}  // namespace

StripeGeometry stripe_geometry(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics,
                               const std::vector<StripeOrientation>& orientations, ImageSize projector) {
  StripeGeometry geometry;
  std::vector<cv::Mat1i> codes;
  for (std::size_t o = 0; o < orientations.size(); ++o) {
    codes.push_back(decode(o, orientations[o].bits, contents, statistics));
    geometry.orientations.push_back(codes[o].empty() ? StripeGeometry::Orientation{}
                                                     : measure(codes[o], orientations[o], projector));
  }
  for (std::size_t a = 0; a < orientations.size(); ++a) {
    for (std::size_t b = a + 1; b < orientations.size(); ++b) {
      const double sine = std::sin(orientations[b].angle_rad - orientations[a].angle_rad);
      if (codes[a].empty() || codes[b].empty() || std::abs(sine) < 0.3) continue;
      StripeGeometry::Pair pair = measure(codes[a], codes[b], sine, statistics.band_rows);
      pair.first = a;
      pair.second = b;
      geometry.pairs.push_back(pair);
    }
  }
  return geometry;
}

}  // namespace crumple
