// The surface that two stations measured, as an observation of both and of the rig:
//
//   n . lens_projector(X) - coordinate   px, 1 per point
//
// X is where the camera's ray at `here` meets the tangent plane that `there` measured: through the point of its own
// pixel and coordinate, with its normal, carried by both stations' poses. So the residual is in stripe coordinates as
// decoded, whatever the distance and the slant, and its noise that of the coordinate with the plane's beside it (about
// the root of two times as much where both are single readings).
//
// What the rig gets wrong moves both sides, each through its own pixel: what two stations see in the same part of their
// images says nothing of the rig, the rest does. The normals are taken as exact: X lies within a patch's spacing of the
// plane's point, over which a normal's error of a few mrad is less than the noise (recon/surface_patches.h).
#pragma once

#include <memory>

#include "solvers/residuals.h"

namespace crumple {

// Refers to the observations, which must outlive it.
std::unique_ptr<View> overlap_view(const OverlapView& observations);

}  // namespace crumple
