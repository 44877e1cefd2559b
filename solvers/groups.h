// Groups of observations that share a sigma: those of one kind by one sensor (solvers/bundle.h).
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "solvers/bundle.h"
#include "solvers/residuals.h"
#include "solvers/weights.h"

namespace crumple {

using GroupKey = std::pair<std::size_t, View::Kind>;  // sensor and kind

constexpr double kSigmaFloor_px = 1e-9;  // noise-free data must not divide by zero

GroupKey key_of(const View& view);

// By BundleOptions::known_sigma_px.
std::optional<double> known_sigma(const Rig& rig, const GroupKey& key, const BundleOptions& options);

// Of every view its group's.
void set_sigmas(const std::vector<std::unique_ptr<View>>& views, const std::map<GroupKey, double>& sigmas,
                std::vector<ViewWeights>& weights);

}  // namespace crumple
