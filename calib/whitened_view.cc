#include "calib/whitened_view.h"

#include <algorithm>

#include "solvers/weights.h"

namespace crumple {

bool counted(const Calibration& calibration, std::size_t v) {
  const auto& inlier = calibration.bundle.views[v].inlier;
  return std::any_of(inlier.begin(), inlier.end(), [](char c) { return c != 0; });
}

bool whitened_view(const Calibration& calibration, const View& view, std::size_t v, ViewEvaluation& evaluation) {
  const BundleResult& bundle = calibration.bundle;
  if (!view.evaluate(bundle.state, true, evaluation)) return false;
  const auto group = std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& g) {
    return g.sensor == view.sensor() && g.kind == view.kind();
  });
  const ViewWeights weights{group->sigma_px, calibration.inflation.of(view.kind()), bundle.views[v].inlier};
  whiten(view, weights, evaluation);
  discount(weights, evaluation);
  return true;
}

}  // namespace crumple
