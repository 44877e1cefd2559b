// A local polynomial surface fit: moving least squares (Alexa et al., Computing and Rendering Point Set Surfaces, IEEE
// TVCG 2003) with PCL's fit (pcl::MLSResult).
//
// Every point moves along the normal of a plane through its neighbours within the radius onto a polynomial fitted to
// their heights, with weights exp(-d^2 / radius^2) of their distances; its normal becomes the polynomial's.
//
// This trades detail for noise, which nothing else here does: what is narrower than the radius is flattened, edges are
// rounded. sigma_mm and the covariance stay what they were. They bound a point's own noise from above: neighbours share
// theirs afterwards, so averaging smoothed points gains nothing, and no sigma of a single point could say so.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "recon/cloud.h"

namespace crumple {

struct SmoothOptions {
  double radius_mm = 2;
  int order = 2;  // of the polynomial in two variables
  int threads = 1;
};

struct SmoothedCloud {
  Cloud cloud;
  // Points that have no more neighbours than the polynomial has terms: they stay as they were.
  std::size_t left_alone = 0;
};

// `viewers_mm`: where the camera stood, per station of the cloud, in its frame; normals point to it. Same result at any
// number of threads.
SmoothedCloud smoothed(const Cloud& cloud, const std::vector<Eigen::Vector3d>& viewers_mm,
                       const SmoothOptions& options);

}  // namespace crumple
