#include "calib/volume_difference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "calib/projection_difference.h"
#include "solvers/closed_form/rigid_fit.h"
#include "solvers/closed_form/triangulate.h"
#include "solvers/decompositions.h"
#include "solvers/rig_covariance.h"
#include "solvers/small_motion.h"

namespace crumple {
namespace {

constexpr int kColumns = 8, kRows = 6;
constexpr int kDepths = 3;
constexpr std::size_t kLeastPoints = 12;
constexpr int kAlignments = 20;
constexpr double kAligned_mm = 1e-8;
constexpr double kDepthShare = 0.25;

using PixelPair = std::array<Eigen::Vector2d, 2>;

Eigen::Vector2d middle_of(const Lens& lens) {
  return {0.5 * (lens.size().width_px - 1), 0.5 * (lens.size().height_px - 1)};
}

// The two sensors of a pair in one of the rigs.
struct Eyes {
  const Rig* rig;
  std::array<std::size_t, 2> sensors;
  const Sensor& sensor(std::size_t i) const { return rig->sensors[sensors[i]]; }
};

std::vector<std::string> row_names(const Eyes& eyes) {
  std::vector<std::string> names;
  for (const std::size_t s : eyes.sensors) {
    const std::vector<std::string> lens = lens_row_names(*eyes.rig, s);
    names.insert(names.end(), lens.begin(), lens.end());
    for (const char* row : kPoseRows) names.push_back(eyes.rig->sensors[s].name + "." + row);
  }
  return names;
}

// What both sensors of A see of a grid over the first one's image, with the
// pixels.
void see_volume(const Eyes& a, const VolumeDepth& depth, std::vector<Eigen::Vector3d>& points,
                std::vector<PixelPair>& pixels) {
  const Lens &first = a.sensor(0).lens, &second = a.sensor(1).lens;
  const Pose mount_from_first = a.sensor(0).sensor_from_mount.inverse();
  for (int d = 0; d < kDepths; ++d) {
    const double distance_mm = depth.near_mm + d * (depth.far_mm - depth.near_mm) / (kDepths - 1);
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Eigen::Vector2d pixel((i % kColumns + 0.5) / kColumns * first.size().width_px - 0.5,
                                  (i / kColumns + 0.5) / kRows * first.size().height_px - 0.5);
      const auto ray = first.ray(pixel);
      if (!ray) continue;
      const Eigen::Vector3d point = mount_from_first * (distance_mm * ray->normalized());
      const auto seen = second.project(a.sensor(1).sensor_from_mount * point);
      if (!seen || !second.size().contains(*seen)) continue;
      points.push_back(point);
      pixels.push_back({pixel, *seen});
    }
  }
}

std::optional<Eigen::Vector3d> triangulated(const Eyes& eyes, const PixelPair& pixels) {
  std::vector<Sighting> sightings;
  for (std::size_t i = 0; i < 2; ++i) {
    sightings.push_back({&eyes.sensor(i).lens, eyes.sensor(i).sensor_from_mount, pixels[i]});
  }
  const auto point = triangulate(sightings);
  return point ? std::optional(point->point_mm) : std::nullopt;
}

// How a triangulated point follows from the lens and the mount of both sensors,
// its pixels being as they are.
std::optional<Eigen::MatrixXd> d_point_d_rig(const Eyes& eyes, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 4, 3> by_point;
  std::vector<Eigen::MatrixXd> by_sensor;
  Eigen::Index columns = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Pose& pose = eyes.sensor(i).sensor_from_mount;
    const auto seen = eyes.sensor(i).lens.project_with_gradients(pose * point);
    if (!seen) return std::nullopt;
    by_point.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = seen->d_point * pose.rotation.toRotationMatrix();
    by_sensor.emplace_back(2, seen->d_parameters.cols() + 6);
    by_sensor.back() << seen->d_parameters, seen->d_point * d_transformed_d_pose(pose, point);
    columns += by_sensor.back().cols();
  }
  Eigen::MatrixXd by_rig = Eigen::MatrixXd::Zero(4, columns);
  by_rig.topLeftCorner(2, by_sensor[0].cols()) = by_sensor[0];
  by_rig.bottomRightCorner(2, by_sensor[1].cols()) = by_sensor[1];
  return Eigen::MatrixXd(-solve_symmetric(by_point.transpose() * by_point, by_point.transpose() * by_rig));
}

// The same points by both calibrations, and how they follow from each one's
// rows.
struct TwicePoints {
  std::vector<Eigen::Vector3d> a, b;
  Eigen::MatrixXd d_a, d_b;
};

void append(const Eigen::MatrixXd& rows, Eigen::MatrixXd& matrix) {
  matrix.conservativeResize(matrix.rows() + rows.rows(), rows.cols());
  matrix.bottomRows(rows.rows()) = rows;
}

TwicePoints measured_twice(const Eyes& a, const Eyes& b, const VolumeDepth& depth) {
  std::vector<Eigen::Vector3d> points;
  std::vector<PixelPair> pixels;
  see_volume(a, depth, points, pixels);
  TwicePoints twice;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto again = triangulated(b, pixels[i]);
    if (!again) continue;
    const auto d_a = d_point_d_rig(a, points[i]), d_b = d_point_d_rig(b, *again);
    if (!d_a || !d_b) continue;
    twice.a.push_back(points[i]);
    twice.b.push_back(*again);
    append(*d_a, twice.d_a);
    append(*d_b, twice.d_b);
  }
  return twice;
}

// B minus A after a motion of A.
Differences differences_of(const TwicePoints& points, const Pose& b_from_a, const Eigen::MatrixXd& root_a,
                           const Eigen::MatrixXd& root_b, double no_difference_mm) {
  const auto rows = 3 * static_cast<Eigen::Index>(points.a.size());
  const Eigen::Matrix3d turn = b_from_a.rotation.toRotationMatrix();
  Differences d{.dimension = 3,
                .values = Eigen::VectorXd(rows),
                .by_frame = {},
                .root = Eigen::MatrixXd(rows, root_a.cols() + root_b.cols()),
                .floor = no_difference_mm};
  std::vector<Eigen::Vector3d> moved;
  for (std::size_t i = 0; i < points.a.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    moved.push_back(b_from_a * points.a[i]);
    d.values.segment<3>(row) = points.b[i] - moved.back();
    d.root.block(row, 0, 3, root_a.cols()) = -turn * (points.d_a.middleRows<3>(row) * root_a);
    d.root.block(row, root_a.cols(), 3, root_b.cols()) = points.d_b.middleRows<3>(row) * root_b;
  }
  d.by_frame = -d_points_d_motion(moved);
  return d;
}

// With the motion that fits best.
AlignedDifference align(const TwicePoints& points, const Eigen::MatrixXd& root_a, const Eigen::MatrixXd& root_b,
                        double no_difference_mm, Pose& b_from_a) {
  b_from_a = rigid_fit(points.a, points.b).value_or(Pose{});
  AlignedDifference aligned;
  for (int turn = 0; turn < kAlignments; ++turn) {
    const Differences differences = differences_of(points, b_from_a, root_a, root_b, no_difference_mm);
    aligned = aligned_difference(differences);
    if ((differences.by_frame * aligned.motion).cwiseAbs().maxCoeff() < kAligned_mm) break;
    b_from_a = retract({}, -Vector6d(aligned.motion)) * b_from_a;
  }
  return aligned;
}

struct CommonLeds {
  std::vector<std::string> names;
  TwicePoints points;
};

CommonLeds common_leds(const Rig& a, const Rig& b) {
  CommonLeds common;
  for (const Led& led : a.leds) {
    const auto again = std::find_if(b.leds.begin(), b.leds.end(), [&](const Led& l) { return l.name == led.name; });
    if (led.mount != Mount::probe || again == b.leds.end() || again->mount != Mount::probe) continue;
    common.names.push_back(led.name);
    common.points.a.push_back(led.position_mm);
    common.points.b.push_back(again->position_mm);
  }
  return common;
}

}  // namespace

std::optional<VolumeDepth> common_depth(const Sensor& first, const Sensor& second) {
  std::vector<Eigen::Vector3d> origins, directions;
  for (const Sensor* sensor : {&first, &second}) {
    const auto ray = sensor->lens.ray(middle_of(sensor->lens));
    if (!ray) return std::nullopt;
    const Pose mount_from_sensor = sensor->sensor_from_mount.inverse();
    origins.push_back(mount_from_sensor.translation);
    directions.push_back(mount_from_sensor.rotation * ray->normalized());
  }
  const auto crossing = nearest_to_rays(origins, directions);
  if (!crossing) return std::nullopt;
  const double distance_mm = directions[0].dot(*crossing - origins[0]);
  if (!(distance_mm > 0) || !(directions[1].dot(*crossing - origins[1]) > 0)) return std::nullopt;
  return VolumeDepth{(1 - kDepthShare) * distance_mm, (1 + kDepthShare) * distance_mm};
}

Expected<VolumeDifference> volume_difference(const Rig& a, const Rig& b, const MatchedPair& pair,
                                             const VolumeDepth& depth, double no_difference_mm) {
  const Eyes eyes_a{&a, {pair.first_a, pair.second_a}}, eyes_b{&b, {pair.first_b, pair.second_b}};
  const TwicePoints points = measured_twice(eyes_a, eyes_b, depth);
  if (points.a.size() < kLeastPoints) {
    return fail(
        fmt::format("{} and {} see hardly anything in common from "
                    "{:.0f} to {:.0f} mm: say with --near_mm and "
                    "--far_mm where they measure",
                    eyes_a.sensor(0).name, eyes_a.sensor(1).name, depth.near_mm, depth.far_mm));
  }
  Pose b_from_a;
  const Eigen::MatrixXd root_a = covariance_root(covariance_of(a.covariance, row_names(eyes_a)));
  const Eigen::MatrixXd root_b = covariance_root(covariance_of(b.covariance, row_names(eyes_b)));
  return VolumeDifference{points.a, align(points, root_a, root_b, no_difference_mm, b_from_a)};
}

std::optional<LedDifference> led_difference(const Rig& a, const Rig& b, const std::optional<MatchedPair>& pair,
                                            const VolumeDepth& depth, double no_difference_mm) {
  CommonLeds leds = common_leds(a, b);
  if (!span_a_frame(leds.points.a) || !span_a_frame(leds.points.b)) return std::nullopt;
  TwicePoints measured;
  std::vector<std::string> names_a, names_b;
  if (pair) {
    const Eyes eyes_a{&a, {pair->first_a, pair->second_a}}, eyes_b{&b, {pair->first_b, pair->second_b}};
    measured = measured_twice(eyes_a, eyes_b, depth);
    names_a = row_names(eyes_a);
    names_b = row_names(eyes_b);
  }
  const auto of_leds = 3 * static_cast<Eigen::Index>(leds.names.size());
  const auto before_a = static_cast<Eigen::Index>(names_a.size()), before_b = static_cast<Eigen::Index>(names_b.size());
  for (const std::string& led : leds.names) {
    for (const char* axis : {".x", ".y", ".z"}) {
      names_a.push_back(led + axis);
      names_b.push_back(led + axis);
    }
  }
  // The rows of both sensors first, then those of the LEDs.
  const Eigen::MatrixXd root_a = covariance_root(covariance_of(a.covariance, names_a));
  const Eigen::MatrixXd root_b = covariance_root(covariance_of(b.covariance, names_b));
  const auto select = [&](Eigen::Index before) {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(of_leds, before + of_leds);
    rows.rightCols(of_leds).setIdentity();
    return rows;
  };
  leds.points.d_a = select(before_a);
  leds.points.d_b = select(before_b);
  Pose b_from_a;
  LedDifference result{leds.names, align(leds.points, root_a, root_b, no_difference_mm, b_from_a), {}};
  if (measured.a.size() < kLeastPoints) return result;
  for (Eigen::MatrixXd* rows : {&measured.d_a, &measured.d_b}) {
    rows->conservativeResize(Eigen::NoChange, rows->cols() + of_leds);
    rows->rightCols(of_leds).setZero();
  }
  Differences carried = differences_of(measured, b_from_a, root_a, root_b, no_difference_mm);
  carried.root -= carried.by_frame * result.mm.root_of_motion;
  carried.by_frame.resize(carried.values.size(), 0);
  result.of_measured = VolumeDifference{measured.a, aligned_difference(carried)};
  return result;
}

}  // namespace crumple
