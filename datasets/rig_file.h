// Rigs on disk: a folder with
//   rig.yaml           schema crumple-rig/1, /2 where there are LEDs or sensors fixed to the world, /3 where the scale
//                      is known, /4 where the calibration had doubts: sensors with their poses, LEDs, sigma per group
//                      of observations, what the scale's uncertainty lacks, the verdict, names of the covariance's
//                      rows. Lengths mm, angles rad.
//   SENSOR.cameramodel one per sensor, mrcal's format: the lens, and the pose once more for readers of that format
//   covariance.npy     where the rig has a covariance
// What is written is read back exactly: poses as quaternions from rig.yaml, lenses from the .cameramodel files.
// Versions 1 and 2 did not record what the scale's uncertainty lacks: where such a rig knows its scale, that is what it
// lacks.
#pragma once

#include <filesystem>

#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// Writes into an existing folder. Fails on sensors or LEDs without a usable name or with the same one, on a number that
// is not finite, and where a file cannot be written.
Expected<void> write_rig(const std::filesystem::path& folder, const Rig& rig);

// Fails, naming file, line and key, on a missing or damaged file, an unknown schema or key, a quaternion that is not of
// unit length, a sensor whose .cameramodel states another lens model, size or pose than rig.yaml (one of them was
// edited), and a covariance that does not fit its rows or is not symmetric with variances above zero.
Expected<Rig> read_rig(const std::filesystem::path& folder);

}  // namespace crumple
