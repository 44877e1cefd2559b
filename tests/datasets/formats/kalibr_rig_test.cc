#include "tests/datasets/formats/made_rig.h"
#include "tests/python.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(KalibrRig, ComesBack) {
  for (const char* const model : {"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4"}) {
    const RigToExport source = made_rig(model, 3);
    std::vector<std::string> lost;
    const auto read = there_and_back("kalibr", source, &lost);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->sensors.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) expect_camera(read->sensors[i], source.rig.sensors[i], model);
    EXPECT_THAT(lost, ElementsAre(HasSubstr("projector proj0"), HasSubstr("covariance"), HasSubstr("sigma_px")));
  }
}

TEST(KalibrRig, OtherLensesAreRefused) {
  for (const char* const model : {"LENSMODEL_OPENCV5", "LENSMODEL_OPENCV8", "LENSMODEL_CAHVOR"}) {
    expect_lens_is_refused("kalibr", model);
  }
}

// By the published description: T_cn_cnm1 takes the camera before to this one, in metres; the chain goes on. Numbers
// that can be followed by hand.
constexpr const char* chain =
    "cam0:\n"
    "  cam_overlaps: [1, 2]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: [-0.25, 0.125, 0.01, 0.02]\n"
    "  distortion_model: radtan\n"
    "  intrinsics: [400.0, 500.0, 320.0, 240.0]\n"
    "  resolution: [640, 480]\n"
    "  rostopic: /cam0/image_raw\n"
    "cam1:\n"
    "  T_cam_imu:\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n"
    "  T_cn_cnm1:\n"
    "  - [0.0, -1.0, 0.0, 0.1]\n  - [1.0, 0.0, 0.0, -0.02]\n  - [0.0, 0.0, 1.0, 0.003]\n  - [0.0, 0.0, 0.0, 1.0]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: []\n"
    "  distortion_model: none\n"
    "  intrinsics: [400, 400, 320, 240]\n"
    "  resolution: [640, 480]\n"
    "  rostopic: /front/camera_1\n"
    "  timeshift_cam_imu: -8.1e-05\n"
    "cam2:\n"
    "  T_cn_cnm1:\n"
    "  - [1.0, 0.0, 0.0, 0.2]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n"
    "  camera_model: pinhole\n"
    "  distortion_coeffs: []\n"
    "  distortion_model: none\n"
    "  intrinsics: [400, 400, 320, 240]\n"
    "  resolution: [640, 480]\n"
    "  rostopic: /rear/image_raw\n";

TEST(KalibrRig, KnownAnswer) {
  const TemporaryFolder home;
  write_content(home / "camchain.yaml", chain);
  const auto read = rig_format("kalibr")->read({home / "camchain.yaml"});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->sensors.size(), 3U);
  EXPECT_EQ(read->sensors[0].name, "cam0");
  EXPECT_EQ(read->sensors[1].name, "cam1");  // its topic is not of the form /NAME/image_raw
  EXPECT_EQ(read->sensors[2].name, "rear");
  const Eigen::Vector3d point(30, 50, 1000);
  EXPECT_LT((read->sensors[1].sensor_from_mount * point - Eigen::Vector3d(50, 10, 1003)).norm(), 1e-10);
  EXPECT_LT((read->sensors[2].sensor_from_mount * point - Eigen::Vector3d(250, 10, 1003)).norm(), 1e-10);
  // radtan at (x, y) = (0.5, 0.5): r2 = 0.5, radial 1 - 0.125 + 0.03125 = 0.90625;
  // x: 0.453125 + 2 r1 x y + r2' (r2 + 2 x^2) = 0.453125 + 0.005 + 0.02 = 0.478125; y: + 0.01 + 0.01 = 0.473125.
  const Eigen::Vector2d pixel = read->sensors[0].lens.project({0.5, 0.5, 1}).value();
  EXPECT_NEAR(pixel.x(), 400 * 0.478125 + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * 0.473125 + 240, 1e-10);
}

TEST(KalibrRig, PyYamlReadsEveryNumberAsOne) {
  if (!python_has("yaml")) GTEST_SKIP() << "Debian's python3-yaml is not installed";
  const TemporaryFolder home;
  ASSERT_TRUE(rig_format("kalibr")->write(made_rig("LENSMODEL_OPENCV4", 2), home.path()));
  EXPECT_THAT(content_of(home / "camchain.yaml"), HasSubstr("1.0e-07"));
  const std::string script =
      "import sys, yaml\n"
      "chain = yaml.safe_load(open(sys.argv[1]))\n"
      "for camera in chain.values():\n"
      "    numbers = camera['intrinsics'] + camera['distortion_coeffs'] + sum(camera.get('T_cn_cnm1', []), [])\n"
      "    assert all(type(n) is float for n in numbers), numbers\n"
      "assert chain['cam1']['distortion_coeffs'][3] == 1e-7\n";
  EXPECT_EQ(run_python(script, (home / "camchain.yaml").string()), "");
}

class DamagedCamchain : public testing::TestWithParam<FileDamage> {};

TEST_P(DamagedCamchain, IsRefused) { expect_damage_is_refused("kalibr", made_rig("LENSMODEL_OPENCV4", 2), GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    KalibrRig, DamagedCamchain,
    testing::Values(FileDamage{"camchain.yaml", "camera_model: pinhole", "camera_model: omni", "pinhole"},
                    FileDamage{"camchain.yaml", "radtan", "equidistant", "no such lens model"},
                    FileDamage{"camchain.yaml", "intrinsics: [1000.1, ", "intrinsics: [", "cam0.intrinsics"},
                    FileDamage{"camchain.yaml", "intrinsics: [1000.1", "intrinsics: [-1000.1", "focal lengths"},
                    FileDamage{"camchain.yaml", "resolution: [1280", "resolution: [1280.5", "whole numbers"},
                    FileDamage{"camchain.yaml", "T_cn_cnm1", "T_cn", "cam1: `T_cn_cnm1` is missing"},
                    FileDamage{"camchain.yaml", "  - [0.0, 0.0, 0.0, 1.0]", "  - [0.0, 0.0, 0.0, 2.0]", "[0, 0, 0, 1]"},
                    FileDamage{"camchain.yaml", "  - [0.9", "  - [0.8", "rotation"},
                    FileDamage{"camchain.yaml", "cam0:", "kam0:", "no cam0"},
                    FileDamage{"camchain.yaml", "cam0:", "cam0: [", "not valid YAML"}));

}  // namespace
}  // namespace crumple
