// Lengths and angles between measured features, with their uncertainty by source.
//
// What features have in common moves them together: variables of the rig and the stations' poses are added up before
// they are squared, so that a distance within a station is better known than its ends, and one across stations worse
// than the decoding says. Features must not share points, since the decoding parts are added as independent.
//
// Linear: of an angle near 0 or 180 degrees, which cannot be less or more, it holds only beyond its own uncertainty.
#pragma once

#include <array>
#include <cmath>

#include "calib/measured_feature.h"

namespace crumple {

// Variances of a quantity by source, in its unit squared.
struct Budget {
  double scale = 0;        // as certificates tell it; 0 where it is not known (PointUncertainty::scale_variables)
  double calibration = 0;  // the rest of the rig's
  double station = 0;
  double decoding = 0;
  double other = 0;  // of a value it was compared with

  double sum() const { return scale + calibration + station + decoding + other; }
  double sigma() const { return std::sqrt(sum()); }
};

struct MeasuredQuantity {
  double value = 0;  // mm, or rad
  Budget budget;
};

// A feature's value, such as the x of a point or the radius of a sphere, `factor` times.
MeasuredQuantity value_of(const PointUncertainty& known, const MeasuredFeature& feature, Eigen::Index value,
                          double factor = 1);

// Between the positions of points and spheres' centres. Fails where they coincide.
Expected<MeasuredQuantity> distance(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& b);
// From a plane, positive on the side of its normal.
MeasuredQuantity distance_from_plane(const PointUncertainty& known, const MeasuredFeature& position,
                                     const MeasuredFeature& plane);
// The same with the features' radii (of spheres): between the outermost points of the two along the line of centres.
Expected<MeasuredQuantity> outer_length(const PointUncertainty& known, const MeasuredFeature& a,
                                        const MeasuredFeature& b);

// How sure a plane's normal is: its tilt (value 0, rad) about the axis in the plane about which it is least sure, then
// about the one at right angles to that. The two tilts are uncorrelated.
struct NormalTilt {
  Eigen::Vector3d about;
  MeasuredQuantity tilt;
};
std::array<NormalTilt, 2> normal_tilts(const PointUncertainty& known, const MeasuredFeature& plane);

// Between the normals of planes, 0 to pi. Fails where they are parallel to rounding.
Expected<MeasuredQuantity> angle(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& b);
// At the second position, between the lines to the first and the third. Fails where the three lie on a line.
Expected<MeasuredQuantity> angle(const PointUncertainty& known, const MeasuredFeature& a, const MeasuredFeature& at,
                                 const MeasuredFeature& b);

}  // namespace crumple
