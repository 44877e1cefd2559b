#include "calib/swapped_axes.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr double kSuspicious_px = 2;
constexpr double kSuspiciousShare = 0.25;
constexpr double kBetter = 0.2;

// The largest scatter of stripes or cast features, outliers included as far as they are no gross errors: that of the
// group's sigma over the share of accepted ones.
double scatter_px(const Calibration& calibration) {
  double largest = 0;
  for (const GroupSummary& group : calibration.bundle.groups) {
    if (group.kind != View::Kind::stripes && group.kind != View::Kind::features) continue;
    const double accepted =
        1 - static_cast<double>(group.outliers) / static_cast<double>(std::max<std::size_t>(1, group.observations));
    largest = std::max(largest, group.sigma_px / std::max(accepted, 1e-3));
  }
  return largest;
}

bool is_suspicious(const Calibration& calibration) {
  return std::any_of(calibration.bundle.groups.begin(), calibration.bundle.groups.end(), [](const GroupSummary& g) {
    const bool of_projector = g.kind == View::Kind::stripes || g.kind == View::Kind::features;
    return of_projector && (g.sigma_px > kSuspicious_px ||
                            static_cast<double>(g.outliers) > kSuspiciousShare * static_cast<double>(g.observations));
  });
}

}  // namespace

CalibrationData with_swapped_axes(CalibrationData data) {
  for (StripeView& view : data.observations.stripes) std::swap(view.normal.x(), view.normal.y());
  for (FeatureView& view : data.observations.features) {
    for (Eigen::Vector2d& pixel : view.projector_pixels) std::swap(pixel.x(), pixel.y());
  }
  for (PixelPairs& pairs : data.pairs) {
    for (Eigen::Vector2d& pixel : pairs.projector_pixels) std::swap(pixel.x(), pixel.y());
  }
  return data;
}

std::optional<std::string> find_swapped_axes(const CalibrationData& data, const CalibrationOptions& options,
                                             const Calibration* found) {
  if (data.pairs.empty() || (found != nullptr && !is_suspicious(*found))) return std::nullopt;
  const auto swapped = calibrate(with_swapped_axes(data), options);
  if (!swapped) return std::nullopt;
  const double theirs = scatter_px(*swapped);
  if (theirs > kSuspicious_px) return std::nullopt;
  if (found != nullptr && theirs > kBetter * scatter_px(*found)) return std::nullopt;
  return fmt::format(
      "the projector's columns and rows are exchanged: the other way round the stripes scatter by {:.2g} px{}; "
      "exchange "
      "them in capture.yaml, where the patterns are listed",
      theirs, found == nullptr ? "" : fmt::format(" instead of {:.2g} px", scatter_px(*found)));
}

}  // namespace crumple
