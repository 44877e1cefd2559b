// The same views of another truth, and with noise drawn anew: what Monte-Carlo campaigns are made of.
#pragma once

#include <random>

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

// Standard deviations per coordinate.
struct NoiseLevels {
  double corner_px = 0;
  double stripe_px = 0;
  double feature_px = 0;
  double led_px = 0;
};

// What the state predicts for each observation of the layout; overlaps are left out. Precondition: it predicts them
// all.
Observations predicted_observations(const CalibrationState& truth, const Observations& layout);

void add_noise(const NoiseLevels& levels, std::mt19937_64& random, Observations& observations);

// Moves that share of the observations by errors drawn evenly from 20 to 200 times their noise, to either side.
void add_gross_errors(double share, const NoiseLevels& levels, std::mt19937_64& random, Observations& observations);

}  // namespace crumple
