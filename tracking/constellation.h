// From lights that blink to LEDs of the rig: where one word blinks at several places of a tracker's image (an LED and
// its reflection in a panel), the pose that the other LEDs give says which place is the LED's.
//
// A candidate is taken where its pixel agrees with the one predicted (the squared difference over the variance of both
// below the gate) and no other of the same word does. The rest is refused, in words. Nothing is guessed: where the LEDs
// without doubt give no pose, all candidates are refused, and so is the station.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "tracking/identify.h"
#include "tracking/led_reading.h"
#include "tracking/probe_pose.h"

namespace crumple {

struct TrackerLights {
  std::size_t sensor = 0;  // of the rig
  Identification lights;
};

struct RefusedLight {
  std::size_t sensor = 0;
  Light light;
  std::string reason;
};

struct Constellation {
  ProbePose pose;                     // from all readings below
  LedReadings readings;               // one per tracker, in the order given; LEDs by their index in the rig
  std::vector<RefusedLight> refused;  // by identification, and candidates not taken
};

// What the identified lights of all trackers say at each repetition of the words, for stillness().
std::vector<LedReadings> readings_over_time(const std::vector<TrackerLights>& trackers,
                                            const std::vector<std::size_t>& led_of_word);

// `led_of_word` gives the rig's index of the LED that blinks each word of the code. Fails where a pose fails, and,
// naming them, where two LEDs blink each other's words (tracking/swapped_leds.h), as then the rest may fit by chance
// alone, and where trackers have other images than their own (tracking/mixed_images.h).
Expected<Constellation> settle_constellation(const Rig& rig, const std::vector<TrackerLights>& trackers,
                                             const std::vector<std::size_t>& led_of_word,
                                             const ProbePoseOptions& options = {});

// As the reference method has it (tracking/paper_pose.h): by the centres of gravity, or another place, of the lights
// that are told without regard to a pose, candidates passed over; the pose has neither covariance nor residuals. Fails
// where that pose fails, and on swapped words and mixed images as above, which triangulated markers alone would not
// show.
Expected<Constellation> settle_by_markers(const Rig& rig, const std::vector<TrackerLights>& trackers,
                                          const std::vector<std::size_t>& led_of_word,
                                          Eigen::Vector2d Light::*place = &Light::centre_of_gravity_px);

// Of the probe's LEDs those that the pose was made of: what was left out there stays out.
LedReadings used_readings(const Rig& rig, const Constellation& where);

}  // namespace crumple
