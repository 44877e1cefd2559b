// The LEDs of a probe that no rig knows, from what calibrated trackers see of them while it is moved about: a rig to
// track it with.
//
// The LEDs' frame: that of their nominal places where three of them have some, else their own (calib/led_frame.h). It
// is one the LEDs define: position and direction of the constellation as a whole carry no uncertainty, the covariance
// is that of its shape (an S-transformation, Baarda 1973: cov' = P cov P, P = 1 - G (G'G)^-1 G' without the rigid
// motions G).
#pragma once

#include <map>
#include <string>

#include "calib/calibrate.h"

namespace crumple {

struct UnknownProbe {
  Rig rig;                  // the trackers as they were, and the LEDs, with the joint covariance of both
  Calibration calibration;  // of stations before the trackers
};

// `data` holds trackers alone, and LEDs of which the rig knows none. `nominal_mm` by the LEDs' names. Fails where
// nothing can be triangulated, and where LEDs lie on a line.
Expected<UnknownProbe> unknown_probe(const CalibrationData& data, const EarlierRig& trackers,
                                     const std::map<std::string, Eigen::Vector3d>& nominal_mm, int threads);

}  // namespace crumple
