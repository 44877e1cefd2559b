#include <iomanip>
#include <sstream>

#include "tests/datasets/formats/made_rig.h"
#include "tests/python.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct LensPair {
  const char* written;
  const char* read;
};

TEST(RosRig, APairComesBack) {
  for (const auto& [written, read_as] :
       {LensPair{"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV5"}, LensPair{"LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5"},
        LensPair{"LENSMODEL_OPENCV5", "LENSMODEL_OPENCV5"}, LensPair{"LENSMODEL_OPENCV8", "LENSMODEL_OPENCV8"}}) {
    const RigToExport source = made_rig(written, 2);
    std::vector<std::string> lost;
    const auto read = there_and_back("ros", source, &lost);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->sensors.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) expect_camera(read->sensors[i], source.rig.sensors[i], read_as);
    EXPECT_THAT(lost, ElementsAre(HasSubstr("projector proj0"), HasSubstr("covariance"), HasSubstr("sigma_px")));
  }
}

TEST(RosRig, OneComesBackAndOfThreeThePosesAreSaidToBeLost) {
  EXPECT_EQ(there_and_back("ros", made_rig("LENSMODEL_OPENCV5", 1)).value().sensors.size(), 1U);
  const TemporaryFolder home;
  const auto lost = rig_format("ros")->write(made_rig("LENSMODEL_OPENCV5", 3), home.path());
  ASSERT_TRUE(lost);
  EXPECT_THAT(*lost, testing::Contains(HasSubstr("the cameras' poses")));
  EXPECT_THAT(rig_format("ros")->read({home.path()}).error().message, HasSubstr("two at most"));
}

TEST(RosRig, OtherLensesAreRefused) {
  for (const char* const model : {"LENSMODEL_OPENCV12", "LENSMODEL_CAHVOR"}) expect_lens_is_refused("ros", model);
}

std::string info(const char* name, const char* distortion, const char* rotation, const char* projection) {
  return std::string("image_width: 640\nimage_height: 480\ncamera_name: ") + name +
         "\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, 320, 0, 500, 240, 0, 0, 1]\n" + distortion +
         "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: " + rotation +
         "\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: " + projection + "\n";
}

// By sensor_msgs/CameraInfo: P(0,3) = -fx' B with the second camera at (B, 0, 0) of the rectified first, in metres, and
// R takes a camera's frame to the rectified one. The second camera is rolled by 90 degrees here.
TEST(RosRig, KnownAnswer) {
  const TemporaryFolder home;
  const char* const plumb_bob =
      "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
      "  data: [-0.25, 0.125, 0.01, 0.02, 0.5]\n";
  write_content(home / "a.yaml", info("narrow_stereo/right", plumb_bob, "[0, -1, 0, 1, 0, 0, 0, 0, 1]",
                                      "[500, 0, 300, -50, 0, 500, 200, 0, 0, 0, 1, 0]"));
  write_content(home / "b.yaml",
                info("left", plumb_bob, "[1, 0, 0, 0, 1, 0, 0, 0, 1]", "[500, 0, 300, 0, 0, 500, 200, 0, 0, 0, 1, 0]"));
  const auto read = rig_format("ros")->read({home / "a.yaml", home / "b.yaml"});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->sensors.size(), 2U);
  EXPECT_EQ(read->sensors[0].name, "left");
  EXPECT_EQ(read->sensors[1].name, "narrow_stereo_right");
  // (30, 50, 1000) in the left is (30 - 100, 50, 1000) in the rectified right, and R' of that: (50, 70, 1000).
  EXPECT_LT((read->sensors[1].sensor_from_mount * Eigen::Vector3d(30, 50, 1000) - Eigen::Vector3d(50, 70, 1000)).norm(),
            1e-10);
  // plumb_bob at (0.5, 0.5): r2 = 0.5, radial 1 - 0.125 + 0.03125 + 0.0625 = 0.96875; see the test of Kalibr's for
  // more.
  const Eigen::Vector2d pixel = read->sensors[0].lens.project({0.5, 0.5, 1}).value();
  EXPECT_NEAR(pixel.x(), 400 * (0.484375 + 0.025) + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * (0.484375 + 0.02) + 240, 1e-10);
}

std::string python_point(const std::string& name, const Eigen::Vector3d& point) {
  std::ostringstream text;
  text << std::setprecision(17) << name << " = np.array((" << point.x() << ", " << point.y() << ", " << point.z()
       << "))\n";
  return text.str();
}

// What is written is a rectification: both rectified images show a point in the same row, and P(0,3) is its disparity.
TEST(RosRig, RectifiesThePair) {
  if (!python_has("yaml")) GTEST_SKIP() << "Debian's python3-yaml is not installed";
  if (!python_has("numpy")) GTEST_SKIP() << "Debian's python3-numpy is not installed";
  const TemporaryFolder home;
  const RigToExport source = made_rig("LENSMODEL_OPENCV5", 2);
  ASSERT_TRUE(rig_format("ros")->write(source, home.path()));
  const Eigen::Vector3d second = source.rig.sensors[1].sensor_from_mount * Eigen::Vector3d(80, -60, 700);
  const std::string script =
      "import sys, yaml, numpy as np\n"
      "def row(name, point):\n"
      "    info = yaml.safe_load(open('%s/%s.yaml' % (sys.argv[1], name)))\n"
      "    matrix = lambda k: np.array(info[k]['data'], float).reshape(info[k]['rows'], info[k]['cols'])\n"
      "    p = matrix('projection_matrix')[:, :3] @ matrix('rectification_matrix') @ point\n"
      "    return p[1] / p[2], p[0] / p[2], matrix('projection_matrix')[0, 3] / p[2]\n" +
      python_point("first", {0.08, -0.06, 0.7}) + python_point("second", second / 1000) +
      "a, b = row('cam0', first), row('cam1', second)\n"
      "assert abs(a[0] - b[0]) < 1e-9, (a, b)\n"
      "assert abs(b[1] - a[1] - b[2]) < 1e-9 and b[2] < 0, (a, b)\n";
  EXPECT_EQ(run_python(script, home.path().string()), "");
}

class DamagedCameraInfo : public testing::TestWithParam<FileDamage> {};

TEST_P(DamagedCameraInfo, IsRefused) { expect_damage_is_refused("ros", made_rig("LENSMODEL_OPENCV5", 2), GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    RosRig, DamagedCameraInfo,
    testing::Values(FileDamage{"cam1.yaml", "plumb_bob", "equidistant", "no such lens model"},
                    FileDamage{"cam1.yaml", "cols: 5", "cols: 4", "distortion_coefficients.cols"},
                    FileDamage{"cam1.yaml", "image_height", "image_hight", "image_height"},
                    FileDamage{"cam1.yaml", "data: [1001.1, 0.0", "data: [1001.1, 7.0", "skew"},
                    FileDamage{"cam1.yaml", "rectification_matrix", "rectification", "rectification_matrix"},
                    FileDamage{"cam1.yaml", "image_width: 1280", "image_width: \"1280\"", "image_width"}));

TEST(RosRig, TwoCamerasWithoutABaselineAreNoPair) {
  const TemporaryFolder home;
  RigToExport one = made_rig("LENSMODEL_OPENCV5", 1);
  ASSERT_TRUE(rig_format("ros")->write(one, home.path()));
  one.rig.sensors[0].name = "other";
  ASSERT_TRUE(rig_format("ros")->write(one, home.path()));
  EXPECT_THAT(rig_format("ros")->read({home.path()}).error().message,
              testing::AllOf(HasSubstr("cam0 and other"), HasSubstr("poses are not known")));
}

}  // namespace
}  // namespace crumple
