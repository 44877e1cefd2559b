// What a rig measures after it was calibrated: points, distances and a sphere at two new stations, with the uncertainty
// that is stated for them, held against the truth.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "solvers/bundle.h"
#include "tests/solvers/made_system.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {

// Exact; noise is drawn for each measurement.
struct FreshStations {
  MadeSystem made;  // stations 0 and 1, LEDs seen
  NoiseLevels noise;
};

FreshStations fresh_stations(MadeSystemOptions options);

struct MeasuredError {
  std::string quantity;
  Eigen::VectorXd error;
  Eigen::MatrixXd covariance;
};

// World points (frame of the first tracker), distances within a station and between two, a sphere's centre and radius.
// Of the true rig the stations have; `found` is what was calibrated. Fails where something cannot be measured.
Expected<std::vector<MeasuredError>> measure_fresh(const FreshStations& stations, const BundleResult& found,
                                                   std::mt19937_64& random);

}  // namespace crumple
