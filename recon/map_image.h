// What another camera shows, laid onto a cloud: a thermal camera's image, mapped to the points it sees.
//
// A view sees a point that projects into its image, whose normal faces it, and that nothing hides: points are sorted
// into cells of the image, a few points wide, and one that lies behind the nearest of its cell by more than what the
// surface's slope makes of a cell is hidden. Values are sampled bilinearly and averaged over the views that see a
// point, weighted by the cosine of the angle at which they meet the surface.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "recon/cloud.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

class ImageMapper {
 public:
  // The cloud must outlive the mapper.
  explicit ImageMapper(const Cloud& cloud);

  // One image, CV_8U, CV_16U or CV_32F with one channel. Preconditions: it is of the lens's size.
  void add(const cv::Mat& image, const Lens& lens, const Pose& camera_from_cloud);

  // Per point the mean of what views show there, in the image's units; 0 where no view sees it.
  std::vector<float> values() const;
  // How many views see each point.
  const std::vector<float>& views() const { return views_; }

 private:
  const Cloud& cloud_;
  std::vector<double> sums_, weights_;
  std::vector<float> views_;
};

}  // namespace crumple
