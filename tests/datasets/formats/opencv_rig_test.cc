#include <opencv2/calib3d.hpp>

#include "tests/datasets/formats/made_rig.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class EveryOpencvLens : public testing::TestWithParam<const char*> {};

TEST_P(EveryOpencvLens, ComesBack) {
  const RigToExport source = made_rig(GetParam(), 3);
  const auto read = there_and_back("opencv", source);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->sensors.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    expect_camera(read->sensors[i], source.rig.sensors[i], source.rig.sensors[i].lens.model());
  }
}

// The peer itself reads the files and projects with them.
TEST_P(EveryOpencvLens, OpencvProjectsTheSame) {
  const TemporaryFolder home;
  const RigToExport source = made_rig(GetParam(), 2);
  ASSERT_TRUE(rig_format("opencv")->write(source, home.path()));
  for (const Sensor& sensor : source.rig.sensors) {
    const cv::FileStorage file((home / (sensor.name + ".yml")).string(), cv::FileStorage::READ);
    cv::Mat matrix, distortion, rotation, translation, rotation_vector;
    file["camera_matrix"] >> matrix;
    file["distortion_coefficients"] >> distortion;
    file["R"] >> rotation;
    file["T"] >> translation;
    EXPECT_EQ(static_cast<int>(file["image_width"]), 1280);
    EXPECT_EQ(static_cast<int>(file["image_height"]), 1024);
    cv::Rodrigues(rotation, rotation_vector);
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(std::vector<cv::Point3d>{{80, -60, 700}}, rotation_vector, translation, matrix, distortion,
                      pixels);
    const Eigen::Vector2d ours = sensor.lens.project(sensor.sensor_from_mount * Eigen::Vector3d(80, -60, 700)).value();
    EXPECT_NEAR(pixels[0].x, ours.x(), 1e-9) << sensor.name;
    EXPECT_NEAR(pixels[0].y, ours.y(), 1e-9) << sensor.name;
  }
}

INSTANTIATE_TEST_SUITE_P(OpencvRig, EveryOpencvLens,
                         testing::Values("LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5",
                                         "LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12"));

TEST(OpencvRig, SaysWhatIsLeftBehind) {
  std::vector<std::string> lost;
  ASSERT_TRUE(there_and_back("opencv", made_rig("LENSMODEL_OPENCV5", 1), &lost));
  EXPECT_THAT(lost, ElementsAre(HasSubstr("covariance"), HasSubstr("sigma_px")));
}

TEST(OpencvRig, WritesOtherUnits) {
  RigToExport source = made_rig("LENSMODEL_OPENCV5", 2);
  source.mm_per_unit = 1000;
  const auto read = there_and_back("opencv", source);
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->sensors[1].sensor_from_mount.translation.x(), -0.110 / 3, 1e-15);
}

TEST(OpencvRig, OtherLensesAreRefused) {
  expect_lens_is_refused("opencv", "LENSMODEL_CAHVOR");
  expect_lens_is_refused("opencv", splined_model);
}

// What a calibration program of OpenCV's own leaves: no pose, single precision, 5 terms as a row.
TEST(OpencvRig, ReadsTheCalibrationSample) {
  const TemporaryFolder home;
  const std::string text =
      "%YAML:1.0\n---\ncalibration_time: \"today\"\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 536.5, 0., 342.25, 0., 536.25, 235.5, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: f\n"
      "   data: [ -0.25, -0.125, 0., 0., 0.5 ]\navg_reprojection_error: 0.3\n";
  write_content(home / "left.yml", text);
  const auto read = rig_format("opencv")->read({home / "left.yml"});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->sensors[0].name, "left");
  EXPECT_EQ(read->sensors[0].lens.model(), "LENSMODEL_OPENCV5");
  EXPECT_EQ(read->sensors[0].lens.parameters(),
            (std::vector<double>{536.5, 536.25, 342.25, 235.5, -0.25, -0.125, 0, 0, 0.5}));
  write_content(home / "right.yml", text);
  EXPECT_THAT(rig_format("opencv")->read({home / "left.yml", home / "right.yml"}).error().message,
              testing::AllOf(HasSubstr("right.yml"), HasSubstr("'R' is missing")));
}

class DamagedOpencvFile : public testing::TestWithParam<FileDamage> {};

TEST_P(DamagedOpencvFile, IsRefused) {
  expect_damage_is_refused("opencv", made_rig("LENSMODEL_OPENCV5", 2), GetParam());
}

INSTANTIATE_TEST_SUITE_P(
    OpencvRig, DamagedOpencvFile,
    testing::Values(FileDamage{"cam1.yml", "image_width", "image_breadth", "'image_width'"},
                    FileDamage{"cam1.yml", "1280", "-1", "'image_width'"},
                    FileDamage{"cam1.yml", "camera_matrix", "matrix", "'camera_matrix' is missing"},
                    FileDamage{"cam1.yml", "rows: 5", "rows: 4", "FileStorage"},
                    FileDamage{"cam1.yml", "rows: 5", "rows: 2000000000", "at most 14 terms"},
                    FileDamage{"cam1.yml", "data: [ 1.0011", "data: [ .nan, 1.0011", "FileStorage"},
                    FileDamage{"cam1.yml", "0., 6.395", "3., 6.395", "skew"},
                    FileDamage{"cam1.yml", "data: [ 9.7", "data: [ 9.8", "rotation"},
                    FileDamage{"cam1.yml", "sensor_kind: camera", "sensor_kind: laser", "camera or"},
                    FileDamage{"cam1.yml", "%YAML:1.0", "hello", "FileStorage"}));

TEST(OpencvRig, AMissingFileIsNamed) {
  const TemporaryFolder home;
  EXPECT_THAT(rig_format("opencv")->read({home / "none.yml"}).error().message, HasSubstr("none.yml does not exist"));
  EXPECT_THAT(rig_format("opencv")->read({home.path()}).error().message, HasSubstr("holds no .yml file"));
}

}  // namespace
}  // namespace crumple
