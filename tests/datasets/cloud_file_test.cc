#include "datasets/cloud_file.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

Cloud example_cloud() {
  Cloud cloud{"world", {"door, left", "2"}, {}};
  for (int i = 0; i < 20000; ++i) {
    CloudPoint point;
    point.position_mm = {i / 3.0, -1e-7 * i, 4000.123456789};
    point.normal = {0, 0.6F, -0.8F};
    point.intensity = static_cast<float>(i) / 20000;
    point.sigma_mm = 0.01F;
    point.covariance_mm2 << 1, 2, 3, 2, 4, 5, 3, 5, static_cast<float>(i);
    point.station = static_cast<std::uint16_t>(i % 2);
    point.quality = 0.5F;
    point.view = static_cast<std::uint16_t>(i % 3);
    cloud.points.push_back(point);
  }
  cloud.shares = {{7, 1, 0.25F}, {7, 2, 0.75F}, {19999, 0, 1}};
  return cloud;
}

TEST(CloudFile, EveryBitSurvives) {
  const TemporaryFolder home;
  const Cloud cloud = example_cloud();
  ASSERT_TRUE(write_cloud(home / "c.ply", cloud));
  const auto read = read_cloud(home / "c.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->frame, "world");
  EXPECT_EQ(read->stations, cloud.stations);
  ASSERT_EQ(read->points.size(), cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const CloudPoint& a = read->points[i];
    const CloudPoint& b = cloud.points[i];
    ASSERT_EQ(a.position_mm, b.position_mm);
    ASSERT_EQ(a.normal, b.normal);
    ASSERT_EQ(a.intensity, b.intensity);
    ASSERT_EQ(a.sigma_mm, b.sigma_mm);
    ASSERT_EQ(a.covariance_mm2, b.covariance_mm2);
    ASSERT_EQ(a.station, b.station);
    ASSERT_EQ(a.quality, b.quality);
    ASSERT_EQ(a.view, b.view);
  }
  ASSERT_EQ(read->shares.size(), cloud.shares.size());
  for (std::size_t i = 0; i < cloud.shares.size(); ++i) {
    EXPECT_EQ(read->shares[i].point, cloud.shares[i].point);
    EXPECT_EQ(read->shares[i].view, cloud.shares[i].view);
    EXPECT_EQ(read->shares[i].weight, cloud.shares[i].weight);
  }
}

TEST(CloudFile, EmptyCloud) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_cloud(home / "c.ply", {}));
  EXPECT_TRUE(read_cloud(home / "c.ply").value().points.empty());
}

TEST(CloudFile, ReadsAStrangersMesh) {
  const TemporaryFolder home;
  std::string content =
      "ply\r\nformat binary_little_endian 1.0\r\ncomment by hand\r\nelement vertex 2\r\nproperty uchar red\r\n"
      "property float32 y\r\nproperty float32 x\r\nproperty int16 z\r\nelement face 1\r\n"
      "property list uchar int vertex_indices\r\nend_header\r\n";
  for (const float y : {1.5F, -2.5F}) {
    const float x = 0.25F;
    const std::int16_t z = -7;
    content += 'r';
    content.append(reinterpret_cast<const char*>(&y), 4);
    content.append(reinterpret_cast<const char*>(&x), 4);
    content.append(reinterpret_cast<const char*>(&z), 2);
  }
  write_content(home / "c.ply", content + "faces");
  const auto cloud = read_cloud(home / "c.ply");
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->points.size(), 2U);
  EXPECT_EQ(cloud->points[0].position_mm, Eigen::Vector3d(0.25, 1.5, -7));
  EXPECT_EQ(cloud->points[1].position_mm, Eigen::Vector3d(0.25, -2.5, -7));
}

TEST(CloudFile, RefusesWhatItCannotRead) {
  const TemporaryFolder home;
  const auto message = [&](const std::string& old_text, const std::string& new_text) {
    EXPECT_TRUE(write_cloud(home / "c.ply", example_cloud()));
    replace_in(home / "c.ply", old_text, new_text);
    const auto cloud = read_cloud(home / "c.ply");
    return cloud ? std::string("no error") : cloud.error().message;
  };
  EXPECT_THAT(message("ply\n", "plx\n"), HasSubstr("not a PLY"));
  EXPECT_THAT(message("binary_little_endian", "ascii"), HasSubstr("ascii"));
  EXPECT_THAT(message("vertex 20000", "vertex 20001"), HasSubstr("cut short"));
  EXPECT_THAT(message("vertex 20000", "vertex 18446744073709551615"), HasSubstr("cut short"));
  EXPECT_THAT(message("vertex 20000", "vertex many"), HasSubstr("vertex"));
  EXPECT_THAT(message("double x", "double u"), HasSubstr("x, y and z"));
  EXPECT_THAT(message("double x", "list uchar double x"), HasSubstr("list"));
  EXPECT_THAT(message("comment station 1 2\n", ""), HasSubstr("station 1"));
  EXPECT_THAT(message("share 3", "share 4"), HasSubstr("cut short"));
  EXPECT_THAT(message("uint point", "int point"), HasSubstr("uint point"));
  EXPECT_THAT(message("property float weight\n", ""), HasSubstr("float weight"));
  EXPECT_THAT(message("end_header", "end_headers"), HasSubstr("header"));
  EXPECT_THAT(read_cloud(home / "none").error().message, HasSubstr("none"));
  EXPECT_FALSE(read_cloud(home.path()));
}

TEST(CloudFile, RefusesANumberThatIsNotFinite) {
  const TemporaryFolder home;
  Cloud cloud = example_cloud();
  cloud.points[7].position_mm.y() = NAN;
  const auto written = write_cloud(home / "c.ply", cloud);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("point 7"));
  EXPECT_EQ(home.entries(), 0);
}

TEST(CloudFile, RefusesAStationThatIsNoNumber) {
  const TemporaryFolder home;
  std::string content =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\n"
      "property float station\nend_header\nxyz";
  const float station = std::numeric_limits<float>::quiet_NaN();
  content.append(reinterpret_cast<const char*>(&station), sizeof(station));
  write_content(home / "c.ply", content);
  EXPECT_THAT(read_cloud(home / "c.ply").error().message, HasSubstr("point 0 has a number that is not finite"));
}

}  // namespace
}  // namespace crumple
