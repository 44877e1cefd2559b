#include "tests/datasets/formats/made_rig.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(ColmapRig, ComesBack) {
  for (const char* const model : {"LENSMODEL_PINHOLE", "LENSMODEL_OPENCV4", "LENSMODEL_OPENCV5", "LENSMODEL_OPENCV8"}) {
    const RigToExport source = made_rig(model, 3);
    std::vector<std::string> lost;
    const auto read = there_and_back("colmap", source, &lost);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->sensors.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) expect_camera(read->sensors[i], source.rig.sensors[i], model);
    EXPECT_THAT(lost, ElementsAre(HasSubstr("projector proj0"), HasSubstr("covariance"), HasSubstr("sigma_px")));
  }
}

TEST(ColmapRig, ComesBackFromTheImagesWhereThereAreNoRigs) {
  const TemporaryFolder home;
  const RigToExport source = made_rig("LENSMODEL_OPENCV4", 3);
  ASSERT_TRUE(rig_format("colmap")->write(source, home.path()));
  std::filesystem::remove(home / "rigs.txt");
  const auto read = rig_format("colmap")->read({home.path()});
  ASSERT_TRUE(read) << read.error().message;
  for (std::size_t i = 0; i < 3; ++i) {
    expect_camera(read->sensors[i], source.rig.sensors[i], "LENSMODEL_OPENCV4");
  }
}

TEST(ColmapRig, OtherLensesAreRefused) {
  for (const char* const model : {"LENSMODEL_OPENCV12", "LENSMODEL_CAHVOR"}) expect_lens_is_refused("colmap", model);
}

// The centre of the first pixel is (0.5, 0.5) there.
TEST(ColmapRig, PrincipalPointsAreHalfAPixelLarger) {
  const TemporaryFolder home;
  RigToExport source;
  source.rig.sensors.push_back(
      {"cam", SensorKind::camera, Lens::create("LENSMODEL_PINHOLE", {640, 480}, {400, 401, 319.5, 239.5}).value(), {}});
  ASSERT_TRUE(rig_format("colmap")->write(source, home.path()));
  EXPECT_THAT(content_of(home / "cameras.txt"), HasSubstr("\n1 PINHOLE 640 480 400 401 320 240\n"));
}

// The examples of COLMAP's documentation, "Output Format", with a camera of every kind that is read.
void write_documented_model(const TemporaryFolder& home) {
  write_content(home / "cameras.txt",
                "# Camera list with one line of data per camera:\n"
                "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
                "# Number of cameras: 3\n"
                "1 SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152\n"
                "2 PINHOLE 3072 2304 2560.56 2560.56 1536 1152\n"
                "3 SIMPLE_RADIAL 3072 2304 2559.69 1536 1152 -0.0218531\n"
                "4 RADIAL 3072 2304 2559.69 1536 1152 -0.0218531 0.25\n");
  write_content(home / "images.txt",
                "# Image list with two lines of data per image:\n"
                "1 0.851773 0.0165051 0.503764 -0.142941 -0.737434 1.02973 3.74354 1 P1180141.JPG\n"
                "2362.39 248.498 58396 1784.7 268.254 59027 1784.7 268.254 -1\n"
                "2 0.851773 0.0165051 0.503764 -0.142941 -0.737434 1.02973 3.74354 2 right/P1180142.JPG\n"
                "\n"
                "3 1 0 0 0 0 0 0 3 rig1/up side/1.jpg\n"
                "\n");
  write_content(home / "rigs.txt",
                "#   RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[]\n"
                "1 2 CAMERA 1 CAMERA 2 1 -0.9999701516465348 -0.0011120266840749639 -0.0075347911527510894 "
                "0.0012985125893421306 -0.19316906391350164 0.00085222218993398979 0.0070758955539026785\n");
}

TEST(ColmapRig, KnownAnswer) {
  const TemporaryFolder home;
  write_documented_model(home);
  const auto read = rig_format("colmap")->read({home.path()});
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->sensors.size(), 2U);
  EXPECT_EQ(read->sensors[0].name, "P1180141");
  EXPECT_EQ(read->sensors[1].name, "right");
  EXPECT_EQ(read->sensors[0].lens.parameters(), (std::vector<double>{2559.81, 2559.81, 1535.5, 1151.5}));
  const Pose& pose = read->sensors[1].sensor_from_mount;
  EXPECT_EQ(pose.translation, Eigen::Vector3d(-0.19316906391350164, 0.00085222218993398979, 0.0070758955539026785));
  EXPECT_NEAR(2 * std::acos(std::abs(pose.rotation.w())), 2 * std::acos(0.9999701516465348), 1e-9);
}

TEST(ColmapRig, CamerasOfOneRadialTerm) {
  const TemporaryFolder home;
  write_documented_model(home);
  replace_in(home / "rigs.txt", "1 2 CAMERA 1 CAMERA 2 1", "1 2 CAMERA 3 CAMERA 4 1");
  const auto read = rig_format("colmap")->read({home.path()});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->sensors[0].name, "up_side");
  EXPECT_EQ(read->sensors[1].name, "camera4");
  EXPECT_EQ(read->sensors[0].lens.model(), "LENSMODEL_OPENCV4");
  EXPECT_EQ(read->sensors[0].lens.parameters(),
            (std::vector<double>{2559.69, 2559.69, 1535.5, 1151.5, -0.0218531, 0, 0, 0}));
  EXPECT_EQ(read->sensors[1].lens.parameters(),
            (std::vector<double>{2559.69, 2559.69, 1535.5, 1151.5, -0.0218531, 0.25, 0, 0}));
}

class DamagedColmapModel : public testing::TestWithParam<FileDamage> {};

TEST_P(DamagedColmapModel, IsRefused) {
  expect_damage_is_refused("colmap", made_rig("LENSMODEL_OPENCV4", 2), GetParam());
}

INSTANTIATE_TEST_SUITE_P(ColmapRig, DamagedColmapModel,
                         testing::Values(FileDamage{"cameras.txt", "OPENCV", "OPENCV_FISHEYE", "OPENCV_FISHEYE"},
                                         FileDamage{"cameras.txt", "1280", "1280.5", "cameras.txt:2"},
                                         FileDamage{"cameras.txt", "1000.1 ", "", "8 parameters"},
                                         FileDamage{"cameras.txt", "1000.1", "1000.1x", "PARAMS[]"},
                                         FileDamage{"cameras.txt", "1000.1", "nan", "PARAMS[]"},
                                         FileDamage{"cameras.txt", "\n2 OPENCV", "\n1 OPENCV", "already"},
                                         FileDamage{"cameras.txt", "\n2 OPENCV", "\n3 OPENCV", "no camera 2"},
                                         FileDamage{"images.txt", "\n1 1 0 0 0", "\n1 3 0 0 0", "images.txt:3"},
                                         FileDamage{"images.txt", " cam0/0000.png", "", "images.txt:3"},
                                         FileDamage{"rigs.txt", "CAMERA 2 1 ", "CAMERA 2 0 ", "not known"},
                                         FileDamage{"rigs.txt", "CAMERA 2", "IMU 2", "'IMU'"},
                                         FileDamage{"rigs.txt", "\n1 2", "\n2 1 CAMERA 2\n1 2", "2 rigs"}));

TEST(ColmapRig, SeveralImagesOfACameraDoNotMakeARig) {
  const TemporaryFolder home;
  write_documented_model(home);
  std::filesystem::remove(home / "rigs.txt");
  replace_in(home / "images.txt", " 2 right/", " 1 right/");
  EXPECT_THAT(rig_format("colmap")->read({home.path()}).error().message,
              testing::AllOf(HasSubstr("camera 1 has several images"), HasSubstr("rigs.txt")));
  EXPECT_THAT(rig_format("colmap")->read({home / "cameras.txt"}).error().message, HasSubstr("give that folder"));
}

}  // namespace
}  // namespace crumple
