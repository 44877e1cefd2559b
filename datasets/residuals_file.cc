#include "datasets/residuals_file.h"

#include <fmt/format.h>

namespace crumple {
namespace {

// Where the observations of a view lie: their camera, its pixels, and the marked points of a board's view.
struct SeenAt {
  std::size_t camera;
  const std::vector<Eigen::Vector2d>& pixels;
  const std::vector<int>* corners;
};

// In the order of make_views, as BundleResult::views.
std::vector<SeenAt> places(const Observations& observations) {
  std::vector<SeenAt> all;
  for (const CornerView& view : observations.corners) all.push_back({view.sensor, view.pixels, &view.corners});
  for (const StripeView& view : observations.stripes) all.push_back({view.camera, view.camera_pixels, nullptr});
  for (const FeatureView& view : observations.features) all.push_back({view.camera, view.camera_pixels, nullptr});
  return all;
}

}  // namespace

std::string residuals_csv(const Calibration& calibration, const Observations& observations) {
  std::string text = "placement,camera,sensor,kind,index,x_px,y_px,residual_1_px,residual_2_px,accepted\n";
  const std::vector<Sensor>& sensors = calibration.bundle.state.rig.sensors;
  const std::vector<SeenAt> seen = places(observations);
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const ViewSummary& view = calibration.bundle.views[v];
    const Eigen::Index dimension = view.kind == View::Kind::stripes ? 1 : 2;
    for (std::size_t i = 0; i < seen[v].pixels.size(); ++i) {
      const Eigen::Index row = dimension * static_cast<Eigen::Index>(i);
      const std::string second = dimension == 2 ? fmt::format("{:.6f}", view.residuals_px[row + 1]) : "";
      text +=
          fmt::format("{},{},{},{},{},{:.4f},{:.4f},{:.6f},{},{}\n", calibration.placement_names[view.placement],
                      sensors[seen[v].camera].name, sensors[view.sensor].name, name_of(view.kind),
                      seen[v].corners != nullptr ? (*seen[v].corners)[i] : static_cast<int>(i), seen[v].pixels[i].x(),
                      seen[v].pixels[i].y(), view.residuals_px[row], second, view.inlier[i] != 0 ? 1 : 0);
    }
  }
  return text;
}

}  // namespace crumple
