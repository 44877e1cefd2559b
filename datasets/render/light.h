// How light leaves the projector and the surfaces.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "datasets/render/scene.h"

namespace crumple {

// pi times the reflectance (BRDF): Lambert's albedo plus a glossy lobe, GGX with Smith's masking and Schlick's Fresnel
// term (Walter et al. 2007, equations 20, 33, 34; Schlick 1994). All directions are unit and leave the surface; 0 where
// either lies below it.
double reflectance(const Material& material, const Eigen::Vector3d& normal, const Eigen::Vector3d& to_light,
                   const Eigen::Vector3d& to_viewer);

// The share of even light from all around that goes to the viewer: the diffuse albedo plus the coat's mirror term.
double ambient_reflectance(const Material& material, const Eigen::Vector3d& normal, const Eigen::Vector3d& to_viewer);

// Irradiance under a fully lit projector over that at the reference distance, facing it on its axis. Every projector
// pixel sends out the same flux, so that a flat screen facing the projector is lit evenly.
double projector_irradiance(const Eigen::Vector3d& point_in_projector, double cosine_at_surface,
                            double reference_distance_mm);

// The share of a blurred square pixel's light, by axis: how much of what is seen at a continuous pixel coordinate comes
// from each whole pixel. A square of side `pixel_fill` blurred by a Gaussian of sigma `blur_px`; its light is that of a
// full square, so that a gap between pixels darkens nothing on average.
class PixelSpread {
 public:
  PixelSpread(double pixel_fill, double blur_px);

  double reach_px() const { return reach_px_; }  // weights are zero for pixels further off
  // The weight of a pixel whose centre lies `offset_px` from the point looked at.
  double weight(double offset_px) const;

 private:
  double half_fill_px_;
  double inverse_blur_;
  double reach_px_;
};

// What the projector emits per pixel, float, for an 8-bit image.
cv::Mat1f emission(const Emitter& emitter, const cv::Mat& image);

}  // namespace crumple
