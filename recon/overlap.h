// Where two stations measured the same surface: pairs of patches that face each other.
//
// A patch of `here` is paired with the patch of `there` that is nearest to it, where that one is no farther than half
// the diagonal between the patches of `there`, across the surface no farther than the poses may be off, and their
// normals agree; and where the patch of `here` nearest to that one is as near, which keeps the edge of the one from
// being drawn to the other's inside. Of more pairs than wanted some are taken, evenly over all.
//
// Poses are those known so far: what they are off along the surface does no harm as long as normals change little over
// it (point to plane).
#pragma once

#include <cstddef>
#include <vector>

#include "recon/surface_patches.h"

namespace crumple {

struct OverlapOptions {
  std::size_t most = 400;             // pairs
  double across_mm = 8;               // between the surfaces, along the normal
  double largest_normal_angle = 0.2;  // rad
};

struct PatchPair {
  std::size_t here = 0;
  std::size_t there = 0;
};

std::vector<PatchPair> overlap(const std::vector<SurfacePatch>& here, const std::vector<SurfacePatch>& there,
                               const Pose& there_from_here, const OverlapOptions& options = {});

}  // namespace crumple
