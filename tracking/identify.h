// Which LED each spot is, from the frames one camera took while the probe stood still and its LEDs blinked.
//
//   1. Spots of all frames that lie within a radius of each other are one light; its states are read frame by frame.
//   2. All lights are decoded together (tracking/blink_code.h): LEDs share the start phase.
//   3. A light's pixel is the mean of its spots weighted by their covariances. Its covariance is that of the mean,
//   larger
//      by what the spots scatter more than they should, plus that of what no averaging removes.
//   4. Lights that blink the same word at several places (an LED and its reflection) are no LED yet: they are returned
//      as candidates, for a pose to choose from (tracking/constellation.h).
//
// Pixels of the camera; LEDs by their index in the code. Frames are in the order they were taken, one blink state
// long each; frames that are missing are known as such.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "tracking/blink_code.h"
#include "tracking/spots.h"

namespace crumple {

struct IdentifyOptions {
  double radius_px = 2;            // within which spots are one light
  double lasting_sigma_px = 0.01;  // of a light's pixel, added in quadrature
};

// A light's pixel during one repetition of the words: whether anything moved (tracking/stillness.h).
struct LightTime {
  std::size_t repetition = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
};

struct Light {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Vector2d centre_of_gravity_px = Eigen::Vector2d::Zero();  // mean over the frames
  int spots = 0;                                                   // that it is the mean of
  double scatter_chi_square = 0;                                   // of its spots about the mean, of 2 (spots - 1)
  std::vector<LightTime> times = {};                               // ascending; repetitions without a spot are left out
};

struct IdentifiedLight {
  std::size_t led = 0;
  Light light;
  int errors = 0;  // in its word
};

struct UnidentifiedLight {
  Light light;
  std::string reason;
};

struct Identification {
  std::vector<IdentifiedLight> leds;        // by LED, each once
  std::vector<IdentifiedLight> candidates;  // by LED, each at least twice: one of them, or none, is the LED
  std::vector<UnidentifiedLight> refused;
  int start_phase = 0;
  bool start_phase_told = false;
  int frames = 0;  // that were not missing
};

// One set of spots per frame; none where the frame is missing. Fails where no frame is left and where fewer frames are
// given than a word is long.
Expected<Identification> identify_leds(const BlinkCode& code,
                                       const std::vector<std::optional<std::vector<Spot>>>& frames,
                                       const IdentifyOptions& options = {});

}  // namespace crumple
