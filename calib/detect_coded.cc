#include "calib/detect_coded.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "calib/dictionary.h"
#include "calib/grey_image.h"
#include "calib/refine_corner.h"
#include "calib/seen_markers.h"
#include "solvers/closed_form/homography.h"

namespace crumple {
namespace {

// What refine_corner looks at reaches 0.45 of a step; nine tenths of the way to the next edge are left to it.
constexpr double kStepOfFree = 0.9 / 0.45;
constexpr std::size_t kFewestCorners = 4;

struct Candidate {
  int index = 0;  // on the board
  Eigen::Vector2d pixel;
  Eigen::Vector2d step_x;  // as far as the free surroundings allow
  Eigen::Vector2d step_y;
};

// A marker's corners, which touch the dark squares in the gaps.
std::vector<Candidate> marker_corners(const std::vector<SeenMarker>& seen, const Target& target) {
  const double module_mm = target.mark_mm / size_of_dictionary(target.dictionary).modules;
  const double free = kStepOfFree * std::min(module_mm, target.pitch_mm - target.mark_mm) / target.mark_mm;
  std::vector<Candidate> candidates;
  for (const SeenMarker& marker : seen) {
    const auto& c = marker.corners;
    const Eigen::Vector2d x = 0.5 * free * (c[1] - c[0] + c[2] - c[3]), y = 0.5 * free * (c[3] - c[0] + c[2] - c[1]);
    for (int k = 0; k < 4; ++k) {
      candidates.push_back({4 * static_cast<int>(marker.index) + k, c[static_cast<std::size_t>(k)], x, y});
    }
  }
  return candidates;
}

// The inner corner of a ChArUco board, from the markers in the two light squares that meet there.
std::optional<Candidate> inner_corner(int index, const std::vector<SeenMarker>& seen,
                                      const std::vector<TargetMarker>& markers, const Target& target) {
  const Eigen::Vector2d corner = target.pitch_mm * Eigen::Vector2d(index % target.columns, index / target.columns);
  Points2d on_board, pixels;
  for (const SeenMarker& marker : seen) {
    const Eigen::Vector2d centre = markers[marker.index].low_mm + Eigen::Vector2d::Constant(target.mark_mm / 2);
    if ((centre - corner).cwiseAbs().maxCoeff() > 0.75 * target.pitch_mm) continue;
    for (const Eigen::Vector2d& mm : marker_corners_mm(markers[marker.index], target.mark_mm)) on_board.push_back(mm);
    pixels.insert(pixels.end(), marker.corners.begin(), marker.corners.end());
  }
  if (on_board.empty()) return std::nullopt;
  const auto h = homography(on_board, pixels);
  if (!h) return std::nullopt;
  const double step_mm = std::min(kStepOfFree * 0.5 * (target.pitch_mm - target.mark_mm), target.pitch_mm);
  const auto step = [&](const Eigen::Vector2d& along) {
    return Eigen::Vector2d(0.5 * (apply_homography(*h, corner + along) - apply_homography(*h, corner - along)));
  };
  return Candidate{index, apply_homography(*h, corner), step({step_mm, 0}), step({0, step_mm})};
}

std::vector<Candidate> inner_corners(const std::vector<SeenMarker>& seen, const Target& target) {
  const std::vector<TargetMarker> markers = markers_of(target);
  std::vector<Candidate> candidates;
  for (int index = 0; index < target.columns * target.rows; ++index) {
    if (const auto candidate = inner_corner(index, seen, markers, target)) candidates.push_back(*candidate);
  }
  return candidates;
}

}  // namespace

Expected<DetectedBoard> detect_coded(const cv::Mat& image, const Target& target) {
  try {
    const auto seen = see_markers(to_8_bit(image), target);
    if (!seen) return tl::unexpected(seen.error());
    DetectedBoard board;
    for (const Candidate& candidate :
         target.kind == TargetKind::charuco ? inner_corners(*seen, target) : marker_corners(*seen, target)) {
      const auto refined = refine_corner(image, candidate.pixel, candidate.step_x, candidate.step_y);
      if (!refined) {
        ++board.unrefined;
        continue;
      }
      board.corners.push_back(candidate.index);
      board.pixels.push_back(refined->pixel);
    }
    if (board.corners.size() < kFewestCorners) {
      return fail(
          fmt::format("{} markers of the board are found, but only {} corners beside them: the image is too "
                      "blurred, too coarse or too noisy",
                      seen->size(), board.corners.size()));
    }
    return board;
  } catch (const cv::Exception& error) {
    return fail(fmt::format("the marker detector failed: {}", error.err));
  }
}

}  // namespace crumple
