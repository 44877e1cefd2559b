#include "calib/seen_markers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/dictionary.h"
#include "solvers/closed_form/homography.h"

namespace crumple {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

// Of a marker's side: a corner further from where the others put it is another marker's, or none.
constexpr double kMarkerAstray = 0.3;
constexpr double kLeastInPlace = 0.6;  // share of the markers
constexpr double kSideTolerance = 0.2;
constexpr double kSameOutline =
    0.25;  // of a side: further apart, or of another size by more, it is not the same marker's

double side_px(const Corners& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (corners[(i + 1) % 4] - corners[i]).norm();
  return sum / 4;
}

Eigen::Vector2d centre_of(const Corners& corners) { return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]); }

Corners corners_of(const std::vector<cv::Point2f>& quad) {
  Corners corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = {quad[k].x, quad[k].y};
  return corners;
}

struct FoundQuads {
  std::map<int, Corners> read;    // by number; those seen twice are left out, for one of the two is wrong
  std::vector<Corners> outlines;  // of all that might be a marker, read or not
};

FoundQuads find_quads(const cv::Mat& image8, const std::string& dictionary) {
  std::vector<std::vector<cv::Point2f>> quads, rejected;
  std::vector<int> ids;
  cv::aruco::detectMarkers(image8, cv::aruco::getPredefinedDictionary(dictionary_number(dictionary).value()), quads,
                           ids, cv::aruco::DetectorParameters::create(), rejected);
  FoundQuads found;
  std::map<int, int> times;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    ++times[ids[i]];
    found.read[ids[i]] = corners_of(quads[i]);
    found.outlines.push_back(found.read[ids[i]]);
  }
  for (const auto& quad : rejected) found.outlines.push_back(corners_of(quad));
  std::erase_if(found.read, [&](const auto& entry) { return times[entry.first] > 1; });
  return found;
}

// Where the corners of a grid's markers touch the squares in the gaps, a marker's outline runs into theirs. Eating into
// the dark by a pixel parts them, but may spoil the code: so the number is read before, and the outline taken after.
std::map<int, Corners> read_touching_markers(const cv::Mat& image8, const std::string& dictionary) {
  std::map<int, Corners> markers = find_quads(image8, dictionary).read;
  cv::Mat parted;
  cv::dilate(image8, parted, cv::Mat::ones(3, 3, CV_8U));
  const std::vector<Corners> outlines = find_quads(parted, dictionary).outlines;
  for (auto& [id, corners] : markers) {
    const Corners* nearest = nullptr;
    double least = kSameOutline * side_px(corners);
    for (const Corners& outline : outlines) {
      const double apart =
          (centre_of(outline) - centre_of(corners)).norm() + std::abs(side_px(outline) + 2 - side_px(corners));
      if (apart > least) continue;
      nearest = &outline;
      least = apart;
    }
    if (nearest == nullptr) continue;
    const Eigen::Vector2d centre = centre_of(*nearest);
    for (Eigen::Vector2d& corner : corners) {
      const Eigen::Vector2d there =
          *std::min_element(nearest->begin(), nearest->end(), [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
            return (a - corner).norm() < (b - corner).norm();
          });
      corner = there + M_SQRT2 * (there - centre).normalized();
    }
  }
  return markers;
}

Error nothing_of_target(const std::map<int, Corners>& markers, const Target& target) {
  const auto all = markers_of(target);
  if (markers.empty()) {
    return {
        fmt::format("no marker of the dictionary {} is found: is it the board's, and are the markers at least some "
                    "20 px wide?",
                    target.dictionary)};
  }
  return {
      fmt::format("{} markers of {} are found, such as number {}, but none of this board's, {} to {}: another "
                  "board, or a wrong `first_id`",
                  markers.size(), target.dictionary, markers.begin()->first, all.front().id, all.back().id)};
}

// The plane that most markers lie on, by RANSAC over all their corners.
std::optional<Eigen::Matrix3d> pixel_from_board(const std::vector<SeenMarker>& seen,
                                                const std::vector<TargetMarker>& markers, double mark_mm,
                                                double tolerance_px) {
  std::vector<cv::Point2d> on_board, pixels;
  for (const SeenMarker& marker : seen) {
    const auto corners_mm = marker_corners_mm(markers[marker.index], mark_mm);
    for (std::size_t k = 0; k < 4; ++k) {
      on_board.emplace_back(corners_mm[k].x(), corners_mm[k].y());
      pixels.emplace_back(marker.corners[k].x(), marker.corners[k].y());
    }
  }
  const cv::Mat found = cv::findHomography(on_board, pixels, cv::RANSAC, tolerance_px);
  if (found.empty()) return std::nullopt;
  Eigen::Matrix3d h;
  for (int i = 0; i < 9; ++i) h(i / 3, i % 3) = found.at<double>(i / 3, i % 3);
  return h;
}

Corners predicted(const Eigen::Matrix3d& h, const TargetMarker& marker, double mark_mm) {
  Corners corners;
  const auto corners_mm = marker_corners_mm(marker, mark_mm);
  for (std::size_t k = 0; k < 4; ++k) corners[k] = apply_homography(h, corners_mm[k]);
  return corners;
}

// By the distance of the markers from each other, which is the pitch's, how large they are against `mark_mm`; 1 where
// the markers do not lie as the target has them.
double relative_side(const std::vector<SeenMarker>& seen, const std::vector<TargetMarker>& markers, double mark_mm,
                     double tolerance_px) {
  Points2d centres_mm, centres;
  for (const SeenMarker& marker : seen) {
    centres_mm.emplace_back(markers[marker.index].low_mm + Eigen::Vector2d::Constant(mark_mm / 2));
    centres.push_back(centre_of(marker.corners));
  }
  const auto h = homography(centres_mm, centres);
  if (!h) return 1;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if ((apply_homography(*h, centres_mm[i]) - centres[i]).norm() > tolerance_px) return 1;
  }
  std::vector<double> ratios;
  for (const SeenMarker& marker : seen) {
    ratios.push_back(side_px(marker.corners) / side_px(predicted(*h, markers[marker.index], mark_mm)));
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  return ratios[ratios.size() / 2];
}

}  // namespace

Expected<std::vector<SeenMarker>> see_markers(const cv::Mat& image8, const Target& target) {
  const std::map<int, Corners> read = target.kind == TargetKind::apriltag
                                          ? read_touching_markers(image8, target.dictionary)
                                          : find_quads(image8, target.dictionary).read;
  const std::vector<TargetMarker> markers = markers_of(target);
  std::vector<SeenMarker> seen;
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const auto found = read.find(markers[i].id);
    if (found != read.end()) seen.push_back({i, found->second});
  }
  if (seen.empty()) return tl::unexpected(nothing_of_target(read, target));

  const double tolerance_px = kMarkerAstray * side_px(seen[seen.size() / 2].corners);
  const double ratio = relative_side(seen, markers, target.mark_mm, tolerance_px);
  if (std::abs(ratio - 1) > kSideTolerance) {
    return fail(
        fmt::format("against their distances the markers look {:.2f} times as large as the board's {:g} mm: check "
                    "its sizes",
                    ratio, target.mark_mm));
  }
  std::vector<SeenMarker> in_place;
  if (const auto h = pixel_from_board(seen, markers, target.mark_mm, tolerance_px)) {
    for (const SeenMarker& marker : seen) {
      const Corners there = predicted(*h, markers[marker.index], target.mark_mm);
      bool near = true;
      for (std::size_t k = 0; k < 4; ++k) {
        near = near && (there[k] - marker.corners[k]).norm() < kMarkerAstray * side_px(marker.corners);
      }
      if (near) in_place.push_back(marker);
    }
  }
  if (static_cast<double>(in_place.size()) < kLeastInPlace * static_cast<double>(seen.size())) {
    return fail(
        fmt::format("{} of the board's markers are found, but {} of them not where it has them: check its "
                    "columns, rows, sizes and `first_id`",
                    seen.size(), seen.size() - in_place.size()));
  }
  return in_place;
}

}  // namespace crumple
