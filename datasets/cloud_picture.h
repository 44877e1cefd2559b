// A picture of a cloud: shaded relief in parallel projection, coloured by a number per point, with a colour bar.
//
// The view follows the cloud's principal axes: its broad side is seen a little from above and from the side, upright as
// the first camera saw it (y of the cloud's frame points down). Points are splatted with the surface hidden behind
// others left out; light grazes the surface, so that dents show.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recon/cloud.h"
#include "solvers/expected.h"

namespace crumple {

struct CloudPicture {
  std::string title;
  std::string subtitle;
  std::string label;          // of the colour bar, with the unit
  std::vector<float> values;  // one per point
  bool is_signed = false;     // colours diverge from zero, over a range that is the same on both sides
};

// The sigma of every point, in mm.
CloudPicture picture_of_sigma(const Cloud& cloud, std::string title);

// A PNG of 1600 x 1000. Colours reach from the 2nd to the 98th percentile (signed: to the 98th of the absolute values).
// Fails on an empty cloud, and where the file cannot be written.
Expected<void> write_cloud_picture(const std::filesystem::path& file, const Cloud& cloud, const CloudPicture& picture);

}  // namespace crumple
