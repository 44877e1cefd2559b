#include "calib/placed_residuals.h"

#include <map>
#include <utility>

#include "solvers/transfer.h"

namespace crumple {
namespace {

class ResidualPlacer {
 public:
  explicit ResidualPlacer(const BundleResult& bundle)
      : bundle_(bundle), residuals_(bundle.state.rig.sensors.size()), view_(bundle.views.begin()) {
    for (const GroupSummary& group : bundle.groups) sigmas_px_[{group.sensor, group.kind}] = group.sigma_px;
  }

  void add_view(const std::vector<Eigen::Vector2d>& pixels) {
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      add(i, pixels[i], view_->residuals_px.segment<2>(2 * static_cast<Eigen::Index>(i)), std::nullopt);
    }
    ++view_;
  }

  void add_view(const StripeView& seen) {
    const Transfer projector_pixel(bundle_.state, seen.camera, seen.projector, seen.placement, seen.station);
    for (std::size_t i = 0; i < seen.camera_pixels.size(); ++i) {
      const auto pixel = projector_pixel(seen.camera_pixels[i]);
      if (pixel) add(i, *pixel, seen.normal * view_->residuals_px[static_cast<Eigen::Index>(i)], seen.normal);
    }
    ++view_;
  }

  std::vector<std::vector<PlacedResidual>> take() { return std::move(residuals_); }

 private:
  void add(std::size_t i, const Eigen::Vector2d& pixel, const Eigen::Vector2d& residual_px,
           const std::optional<Eigen::Vector2d>& normal) {
    residuals_[view_->sensor].push_back(
        {pixel, residual_px, normal, sigmas_px_.at({view_->sensor, view_->kind}), view_->inlier[i] != 0, view_->kind});
  }

  const BundleResult& bundle_;
  std::vector<std::vector<PlacedResidual>> residuals_;
  std::vector<ViewSummary>::const_iterator view_;
  std::map<std::pair<std::size_t, View::Kind>, double> sigmas_px_;
};

}  // namespace

std::vector<std::vector<PlacedResidual>> placed_residuals(const Observations& observations,
                                                          const BundleResult& bundle) {
  ResidualPlacer placer(bundle);  // in the order of make_views
  for (const CornerView& view : observations.corners) placer.add_view(view.pixels);
  for (const StripeView& view : observations.stripes) placer.add_view(view);
  for (const FeatureView& view : observations.features) placer.add_view(view.camera_pixels);
  for (const LedView& view : observations.leds) placer.add_view(view.pixels);
  return placer.take();
}

}  // namespace crumple
