// What decoded stripe coordinates say about the coarsest bits and the orientations' order, which the frames' mutual
// consistency cannot see: codes that no stripe has, and a map from camera to projector that mirrors.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "datasets/capture.h"
#include "datasets/sequence_statistics.h"

namespace crumple {

struct StripeGeometry {
  struct Orientation {
    std::size_t decoded_pixels = 0;  // those lit
    double outside_share = 0;        // of them, codes that no stripe has
    double outside_if_swapped = 0;   // the same if the coarsest bit's pattern and inverse were swapped
  };
  // Of two orientations at least 17 degrees apart: the share of places where the map does not mirror.
  struct Pair {
    std::size_t first = 0;
    std::size_t second = 0;
    std::size_t places = 0;
    double upright_share = 0;
  };
  std::vector<Orientation> orientations;
  std::vector<Pair> pairs;
};

// Frames must be in the order `contents` says (find_order). Orientations that lack a pattern decode no pixels.
StripeGeometry stripe_geometry(const std::vector<FrameContent>& contents, const SequenceStatistics& statistics,
                               const std::vector<StripeOrientation>& orientations, ImageSize projector);

}  // namespace crumple
