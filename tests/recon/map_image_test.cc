#include "recon/map_image.h"

#include <cmath>

#include <gtest/gtest.h>

namespace crumple {
namespace {

const ImageSize kSize{320, 240};

Lens made_lens() { return *Lens::create("LENSMODEL_PINHOLE", kSize, {300, 300, 159.5, 119.5}); }

// A wall at z = 1000 mm, and before the middle of it a plate at 800.
Cloud wall_and_plate() {
  Cloud cloud;
  for (int row = -60; row <= 60; ++row) {
    for (int column = -80; column <= 80; ++column) {
      CloudPoint point;
      point.position_mm = {6.0 * column, 6.0 * row, 1000};
      point.normal = -Eigen::Vector3f::UnitZ();
      cloud.points.push_back(point);
    }
  }
  for (int row = -20; row <= 20; ++row) {
    for (int column = -20; column <= 20; ++column) {
      CloudPoint point;
      point.position_mm = {5.0 * column, 5.0 * row, 800};
      point.normal = -Eigen::Vector3f::UnitZ();
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

// Levels that tell their pixel.
cv::Mat ramp() {
  cv::Mat1w image(kSize.height_px, kSize.width_px);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) image(y, x) = static_cast<std::uint16_t>(10 * x + 100 * y);
  }
  return image;
}

TEST(MapImage, ShowsEachPointWhatItsPixelShows) {
  const Cloud cloud = wall_and_plate();
  ImageMapper mapper(cloud);
  mapper.add(ramp(), made_lens(), {});
  const std::vector<float> values = mapper.values();
  int hidden = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d& p = cloud.points[i].position_mm;
    const double x = 159.5 + 300 * p.x() / p.z(), y = 119.5 + 300 * p.y() / p.z();
    const bool behind = p.z() > 900 && std::abs(x - 159.5) < 35 && std::abs(y - 119.5) < 35;
    if (x < 0 || y < 0 || x > 319 || y > 239) {
      EXPECT_EQ(mapper.views()[i], 0);
    } else if (mapper.views()[i] == 0) {
      ++hidden;
      EXPECT_GT(p.z(), 900);
      EXPECT_LT(std::abs(x - 159.5), 50) << "hidden beside the plate";
    } else {
      EXPECT_FALSE(behind) << x << " " << y;
      EXPECT_NEAR(values[i], 10 * x + 100 * y, 0.01);
    }
  }
  EXPECT_GT(hidden, 400);
}

TEST(MapImage, AveragesOverViewsAndLeavesOutBacks) {
  Cloud cloud = wall_and_plate();
  cloud.points.resize(161 * 121);
  ImageMapper mapper(cloud);
  mapper.add(cv::Mat1b(240, 320, std::uint8_t{10}), made_lens(), {});
  mapper.add(cv::Mat1b(240, 320, std::uint8_t{40}), made_lens(), {});
  // From behind the wall.
  const Pose from_behind{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())), {0, 0, 2000}};
  mapper.add(cv::Mat1b(240, 320, std::uint8_t{200}), made_lens(), from_behind);
  const std::size_t middle = 60 * 161 + 80;
  EXPECT_EQ(mapper.views()[middle], 2);
  EXPECT_FLOAT_EQ(mapper.values()[middle], 25);
}

}  // namespace
}  // namespace crumple
