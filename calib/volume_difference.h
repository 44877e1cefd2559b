// How far two calibrations of a rig measure the same points apart, in mm, over
// the measuring volume and beside both uncertainties.
//
// Two sensors of one mount see points of the volume: what A sees at a grid of
// the first sensor's pixels and some distances. The same pixels are
// triangulated with B (least squares of reprojection, both sensors alike), and
// what differs after the rigid motion of the mount's frame that fits best,
// weighted by both uncertainties, is compared with the covariance of both
// calibrations (solvers/aligned_difference.h): lenses and mounts of both
// sensors, correlations included. The calibrations are taken as independent.
//
// LEDs on the probe carry its measurements into the world. Their own
// constellation is compared after its best motion; and what a pair on the probe
// measures, after the motion of the LEDs: there a probe shows whose camera has
// moved against its LEDs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "solvers/aligned_difference.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// Below it a difference counts as none.
constexpr double kNoDifference_mm = 1e-3;

// Distances from the first sensor's centre of projection.
struct VolumeDepth {
  double near_mm = 0;
  double far_mm = 0;
};

// Two sensors of a mount, in both rigs.
struct MatchedPair {
  std::size_t first_a = 0, second_a = 0;
  std::size_t first_b = 0, second_b = 0;
};

struct VolumeDifference {
  std::vector<Eigen::Vector3d> points_mm;  // in the frame of the mount in A
  AlignedDifference mm;                    // B minus A
};

// A quarter before and behind where the axes of two sensors, through the
// middles of their images, come closest; none where that is not in front of
// both.
std::optional<VolumeDepth> common_depth(const Sensor& first, const Sensor& second);

// Fails where the sensors have fewer than a dozen points of the grid in common.
Expected<VolumeDifference> volume_difference(const Rig& a, const Rig& b, const MatchedPair& pair,
                                             const VolumeDepth& depth, double no_difference_mm = kNoDifference_mm);

struct LedDifference {
  std::vector<std::string> leds;                // of both rigs' probes
  AlignedDifference mm;                         // B minus A, a point for each
  std::optional<VolumeDifference> of_measured;  // what the pair measures, carried by the LEDs
};

// None with fewer than three LEDs in common that are not on a line. `pair` is
// one on the probe.
std::optional<LedDifference> led_difference(const Rig& a, const Rig& b, const std::optional<MatchedPair>& pair,
                                            const VolumeDepth& depth, double no_difference_mm = kNoDifference_mm);

}  // namespace crumple
