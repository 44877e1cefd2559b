// What diff writes of two rigs.
//
//   projection_SENSOR.csv     x_px,y_px,dx_px,dy_px,sigma_px,sigmas      a line per pixel of the grid
//   projection_SENSOR.png     the same as arrows, enlarged: green within k of their own uncertainty, red beyond
//   volume_FIRST+SECOND.csv   x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,sigma_mm,sigmas   a line per point, frame of the mount
//   leds.csv                  led,dx_mm,dy_mm,dz_mm,sigma_mm,sigmas
//   volume_leds.csv           as a pair's: what the first pair on the probe measures, carried by the LEDs
//
// Differences are the second rig's minus the first's; sigma is their standard uncertainty in its worst direction, from
// both rigs, and sigmas the length of the difference in units of its own covariance.
#pragma once

#include <filesystem>

#include "calib/rig_difference.h"
#include "solvers/expected.h"

namespace crumple {

Expected<void> write_difference_files(const RigDifference& difference, const std::filesystem::path& folder);

}  // namespace crumple
