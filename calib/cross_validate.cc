#include "calib/cross_validate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "recon/triangulate.h"
#include "solvers/closed_form/homography.h"
#include "solvers/closed_form/plane.h"
#include "solvers/closed_form/rigid_fit.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kTrim = 5;
constexpr double kCornerRadius_px = 20;
constexpr double kCornerOutlier = 4;
constexpr int kQuadraticTerms = 6;

// A stripe coordinate at a sub-pixel place, from the readings around it; with its sigma.
struct LocalReading {
  double coordinate_px = 0;
  double sigma_px = 0;
};

// Least squares of the quadratic at the centre; one round of leaving out what lies beyond four robust sigmas.
std::optional<LocalReading> fit_around(const StripeCoordinates& read, const Eigen::Vector2d& centre) {
  std::vector<Eigen::Vector2d> offsets;
  std::vector<double> values;
  const cv::Rect image({0, 0}, read.sigma_px.size());
  const int reach = static_cast<int>(kCornerRadius_px);
  for (int y = static_cast<int>(centre.y()) - reach; y <= static_cast<int>(centre.y()) + reach + 1; ++y) {
    for (int x = static_cast<int>(centre.x()) - reach; x <= static_cast<int>(centre.x()) + reach + 1; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - centre;
      if (!image.contains({x, y}) || offset.norm() > kCornerRadius_px || read.sigma_px.at<float>(y, x) <= 0) continue;
      offsets.push_back(offset);
      values.push_back(read.coordinate_px.at<double>(y, x));
    }
  }
  for (int round = 0; round < 2; ++round) {
    if (offsets.size() < 4 * kQuadraticTerms) return std::nullopt;
    const auto count = static_cast<Eigen::Index>(offsets.size());
    Eigen::MatrixXd terms(count, kQuadraticTerms);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector2d& o = offsets[static_cast<std::size_t>(i)];
      terms.row(i) << 1, o.x(), o.y(), o.x() * o.x(), o.x() * o.y(), o.y() * o.y();
    }
    const Eigen::Map<const Eigen::VectorXd> right(values.data(), count);
    const Eigen::VectorXd solution = least_squares(terms, right);
    const Eigen::VectorXd residuals = (right - terms * solution).cwiseAbs();
    if (round == 1) {
      const double variance = residuals.squaredNorm() / static_cast<double>(count - kQuadraticTerms);
      const Eigen::VectorXd first = Eigen::VectorXd::Unit(kQuadraticTerms, 0);
      const double factor = solve_symmetric(terms.transpose() * terms, first)(0, 0);
      return LocalReading{solution[0], std::sqrt(variance * factor)};
    }
    std::vector<double> sorted(residuals.begin(), residuals.end());
    std::nth_element(sorted.begin(), sorted.begin() + count / 2, sorted.end());
    const double limit = kCornerOutlier * 1.4826 * sorted[static_cast<std::size_t>(count / 2)];
    std::vector<Eigen::Vector2d> kept_offsets;
    std::vector<double> kept_values;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      if (residuals[static_cast<Eigen::Index>(i)] > limit) continue;
      kept_offsets.push_back(offsets[i]);
      kept_values.push_back(values[i]);
    }
    offsets = std::move(kept_offsets);
    values = std::move(kept_values);
  }
  return std::nullopt;
}

// The left-out board's corners in the camera's frame, by index.
std::map<int, Eigen::Vector3d> reconstruct_corners(const StationGeometry& geometry, const StationReadings& readings,
                                                   const CornerView& corners, const StationOptions& options) {
  std::map<int, Eigen::Vector3d> points;
  for (std::size_t i = 0; i < corners.pixels.size(); ++i) {
    const auto ray = geometry.camera.ray(corners.pixels[i]);
    if (!ray || ray->z() <= 0) continue;
    std::vector<DepthReading> depths;
    for (std::size_t o = 0; o < readings.orientations.size(); ++o) {
      const auto read = fit_around(readings.coordinates[o], corners.pixels[i]);
      if (!read) continue;
      const StripeTriangulator triangulate(geometry.projector, geometry.proj_from_cam,
                                           readings.orientations[o].normal());
      const auto depth = triangulate(*ray, read->coordinate_px);
      if (depth) depths.push_back({depth->depth_mm, depth->d_depth_d_coordinate, read->sigma_px});
    }
    if (depths.empty()) continue;
    const auto depth = weighted_depth(depths, options.common_sigma_px, options.gate);
    if (depth) points[corners.corners[i]] = depth->depth_mm * *ray;
  }
  return points;
}

std::vector<Eigen::Vector3d> values_of(const std::map<int, Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> values;
  for (const auto& [corner, point] : points) values.push_back(point);
  return values;
}

double nominal_distance_mm(const Board& board, int a, int b) {
  const auto& points = board.nominal_mm();
  return board.scale * (points[static_cast<std::size_t>(a)] - points[static_cast<std::size_t>(b)]).norm();
}

// The point that lies furthest towards a direction.
int extreme_point(const Board& board, const Eigen::Vector2d& direction) {
  const auto& points = board.nominal_mm();
  const auto furthest = std::max_element(
      points.begin(), points.end(), [&](const auto& a, const auto& b) { return direction.dot(a) < direction.dot(b); });
  return static_cast<int>(furthest - points.begin());
}

// Distances of nearest neighbours, and the diagonals, against the board's.
void judge_corners(const std::map<int, Eigen::Vector3d>& points, const Board& board, HeldOutBoard& result) {
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (int i = 1; i < board.point_count(); ++i) nearest_mm = std::min(nearest_mm, nominal_distance_mm(board, 0, i));
  double squares = 0;
  int pairs = 0;
  for (auto from = points.begin(); from != points.end(); ++from) {
    for (auto to = std::next(from); to != points.end(); ++to) {
      const double nominal_mm = nominal_distance_mm(board, from->first, to->first);
      if (nominal_mm > 1.01 * nearest_mm) continue;
      squares += std::pow((to->second - from->second).norm() - nominal_mm, 2);
      ++pairs;
    }
  }
  result.pitch_rms_mm = pairs > 0 ? std::sqrt(squares / pairs) : 0;
  for (std::size_t d = 0; d < 2; ++d) {
    const Eigen::Vector2d direction(1, d == 0 ? 1 : -1);
    const int first = extreme_point(board, -direction), last = extreme_point(board, direction);
    const auto from = points.find(first), to = points.find(last);
    if (from == points.end() || to == points.end()) continue;
    result.diagonal_error_mm[d] = (to->second - from->second).norm() - nominal_distance_mm(board, first, last);
  }
}

// Dense points in the camera's frame, inside the mask.
std::vector<Eigen::Vector3d> dense_points(const StationCloud& cloud, const RayTable& rays, const cv::Mat& mask) {
  std::vector<Eigen::Vector3d> points;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const double depth = cloud.depth_mm.at<double>(y, x);
      if (mask.at<std::uint8_t>(y, x) != 0 && depth > 0) points.push_back(depth * rays.at(x, y));
    }
  }
  return points;
}

// Heights of the points above the modelled board, which is laid on them by its corners and then levelled (three more
// degrees of freedom, as a plane fit has).
double shape_rms(const std::vector<Eigen::Vector3d>& points, const std::map<int, Eigen::Vector3d>& corners,
                 const Board& board) {
  std::vector<Eigen::Vector3d> on_board, in_camera;
  for (const auto& [corner, point] : corners) {
    on_board.push_back(board.point(corner));
    in_camera.push_back(point);
  }
  const auto board_from_camera = rigid_fit(in_camera, on_board);
  if (!board_from_camera) return 0;
  std::vector<Eigen::Vector3d> heights;
  for (const Eigen::Vector3d& point : points) {
    Eigen::Vector3d p = *board_from_camera * point;
    p.z() -= board.height_mm(p.x(), p.y());
    heights.push_back(p);
  }
  const auto plane = fit_plane_robustly(heights, kTrim);
  return plane ? plane->rms_mm : 0;
}

// Pixels of a chessboard's white squares inside the corners' hull, one pixel from the squares' edges.
cv::Mat white_squares(const CornerView& corners, const Target& board, const cv::Mat& white) {
  std::map<int, Eigen::Vector2d> pixels;
  for (std::size_t i = 0; i < corners.corners.size(); ++i) pixels[corners.corners[i]] = corners.pixels[i];
  std::array<cv::Mat, 2> masks{cv::Mat::zeros(white.size(), CV_8U), cv::Mat::zeros(white.size(), CV_8U)};
  for (const auto& [corner, pixel] : pixels) {
    const int row = corner / board.columns, column = corner % board.columns;
    if (column + 1 == board.columns || row + 1 == board.rows) continue;
    std::vector<Eigen::Vector2d> square;
    for (const int c : {corner, corner + 1, corner + board.columns + 1, corner + board.columns}) {
      if (pixels.contains(c)) square.push_back(pixels[c]);
    }
    if (square.size() < 4) continue;
    cv::Mat one = corner_hull(square, white.size());
    cv::erode(one, one, cv::Mat::ones(3, 3, CV_8U));
    masks[static_cast<std::size_t>((row + column) % 2)] |= one;
  }
  return cv::mean(white, masks[0])[0] > cv::mean(white, masks[1])[0] ? masks[0] : masks[1];
}

double kept_share(const cv::Mat& wanted, const cv::Mat& depth_mm) {
  const cv::Mat kept = wanted & (depth_mm > 0);
  const int all = cv::countNonZero(wanted);
  return all > 0 ? static_cast<double>(cv::countNonZero(kept)) / all : 0;
}

Expected<HeldOutBoard> judge_board(const CalibrationState& state, const BoardSpec& spec, const Board& shape,
                                   const BoardStripes& stripes, const CornerView& corners,
                                   const StationOptions& options) {
  const Sensor& camera = state.rig.sensors[stripes.camera];
  const Sensor& projector = state.rig.sensors[stripes.projector];
  const StationGeometry geometry(camera.lens, projector.lens, camera.sensor_from_mount, projector.sensor_from_mount);
  const auto cloud = reconstruct_readings(geometry, stripes.readings, options);
  if (!cloud) return tl::unexpected(cloud.error());
  const cv::Mat hull = corner_hull(corners.pixels, stripes.readings.white.size());
  const std::vector<Eigen::Vector3d> points = dense_points(*cloud, geometry.rays, hull);
  const auto plane = fit_plane_robustly(points, kTrim);
  if (!plane) return tl::unexpected(plane.error());
  const auto corner_points = reconstruct_corners(geometry, stripes.readings, corners, options);
  const auto corner_plane = fit_plane_robustly(values_of(corner_points), std::numeric_limits<double>::infinity());
  if (!corner_plane) return tl::unexpected(corner_plane.error());

  HeldOutBoard result;
  result.points = points.size();
  // Other targets have markers or dots in the way: all of the hull is wanted there.
  const bool squares = spec.target.kind == TargetKind::chessboard;
  result.kept_of_white =
      kept_share(squares ? white_squares(corners, spec.target, stripes.readings.white) : hull, cloud->depth_mm);
  result.dense_plane_rms_mm = plane->rms_mm;
  result.dense_plane_rms_untrimmed_mm = plane->rms_untrimmed_mm;
  result.trimmed_share = plane->trimmed_share;
  result.dense_shape_rms_mm = shape_rms(points, corner_points, shape);
  result.corner_plane_rms_mm = corner_plane->rms_untrimmed_mm;
  judge_corners(corner_points, shape, result);
  result.mean_sigma_mm = cv::mean(cloud->sigma_mm, hull & (cloud->depth_mm > 0))[0];
  return result;
}

HeldOutBoard mean_of(const std::vector<HeldOutBoard>& boards) {
  HeldOutBoard mean;
  mean.station = "mean";
  const double share = 1 / static_cast<double>(boards.size());
  double points = 0;
  for (const HeldOutBoard& board : boards) {
    points += share * static_cast<double>(board.points);
    mean.kept_of_white += share * board.kept_of_white;
    mean.dense_plane_rms_mm += share * board.dense_plane_rms_mm;
    mean.dense_plane_rms_untrimmed_mm += share * board.dense_plane_rms_untrimmed_mm;
    mean.trimmed_share += share * board.trimmed_share;
    mean.dense_shape_rms_mm += share * board.dense_shape_rms_mm;
    mean.corner_plane_rms_mm += share * board.corner_plane_rms_mm;
    mean.pitch_rms_mm += share * board.pitch_rms_mm;
    mean.diagonal_error_mm[0] +=
        share * 0.5 * (std::abs(board.diagonal_error_mm[0]) + std::abs(board.diagonal_error_mm[1]));
    mean.mean_sigma_mm += share * board.mean_sigma_mm;
  }
  mean.points = static_cast<std::size_t>(std::lround(points));
  return mean;
}

const CornerView* corners_of(const CalibrationData& data, const BoardStripes& stripes) {
  const auto found = std::find_if(
      data.observations.corners.begin(), data.observations.corners.end(),
      [&](const CornerView& view) { return view.sensor == stripes.camera && view.placement == stripes.placement; });
  return found == data.observations.corners.end() ? nullptr : &*found;
}

}  // namespace

Expected<CrossValidation> cross_validate(const CalibrationData& data, const std::vector<BoardStripes>& stripes,
                                         const CalibrationOptions& options, const StationOptions& station_options,
                                         const std::function<void()>& report) {
  CrossValidation result;
  for (const BoardStripes& held_out : stripes) {
    const std::string& station = data.placement_names[held_out.placement];
    const auto calibration = calibrate(without_placement(data, held_out.placement), options);
    if (!calibration) return fail(fmt::format("without station {}: {}", station, calibration.error().message));
    StationOptions named = station_options;
    named.name = "station " + station;
    const std::size_t b = data.board_of[held_out.placement];
    const CalibrationState& state = calibration->bundle.state;
    auto board = judge_board(state, data.boards[b], state.boards[b], held_out, *corners_of(data, held_out), named);
    if (!board) return tl::unexpected(board.error());
    board->station = station;
    result.boards.push_back(std::move(*board));
    report();
  }
  if (result.boards.empty()) return fail("cross-validation needs a projector's stripes on the board");
  result.mean = mean_of(result.boards);
  return result;
}

}  // namespace crumple
