#include "datasets/rig_file.h"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

Rig example_rig() {
  Rig rig;
  rig.sensors.push_back({"cam0",
                         SensorKind::camera,
                         Lens::create("LENSMODEL_OPENCV5", {1280, 1024},
                                      {1000.1, 1001.0 / 3, 639.5, 511.5, -0.1, 1.23e-7, -3.3e-4, 1e-5, 0.3})
                             .value(),
                         {}});
  rig.sensors.push_back({"proj-0",
                         SensorKind::projector,
                         Lens::create("LENSMODEL_PINHOLE", {1024, 768}, {1900, 1900, 511.5, 850}).value(),
                         {rotation_from_vector({0.1, M_PI - 1e-9, -1e-12}), {1.0 / 3, -200, 1e-9}}});
  rig.sigma_px = {{"cam0.corners", 0.1234567890123456}, {"proj-0.stripes", 1.0 / 7}};
  rig.covariance.names = {"cam0.fx", "proj-0.translation_x"};
  rig.covariance.matrix.resize(2, 2);
  rig.covariance.matrix << 1.0 / 3, 1e-17, 1e-17, 1e-12;
  return rig;
}

// The example with a tracker and two LEDs.
Rig tracked_rig() {
  Rig rig = example_rig();
  Sensor tracker = rig.sensors.front();
  tracker.name = "tracker0";
  tracker.mount = Mount::world;
  tracker.sensor_from_mount = {rotation_from_vector({0, 0.3, 0.1}), {-800, 1.0 / 3, 7}};
  rig.sensors.push_back(tracker);
  Sensor moved = tracker;
  moved.name = "tracker0b";
  moved.sensor_from_mount = {rotation_from_vector({0, -0.3, 0.1}), {800, 1.0 / 3, 7}};
  moved.lens_of = rig.sensors.size() - 1;
  rig.sensors.push_back(moved);
  rig.leds = {{"a", {10, -20.25, 1.0 / 7}, Mount::probe}, {"floor", {0, 0, 1e4}, Mount::world}};
  return rig;
}

// The example with a board of known scale.
Rig scaled_rig() {
  Rig rig = example_rig();
  rig.covariance.names.emplace_back("board.scale");
  rig.covariance.matrix.conservativeResizeLike(Eigen::MatrixXd::Zero(3, 3));
  rig.covariance.matrix(2, 2) = 1e-10;
  return rig;
}

void expect_same(const Rig& a, const Rig& b) {
  ASSERT_EQ(a.sensors.size(), b.sensors.size());
  for (std::size_t i = 0; i < a.sensors.size(); ++i) {
    const Sensor& x = a.sensors[i];
    const Sensor& y = b.sensors[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.kind, y.kind);
    EXPECT_EQ(x.mount, y.mount);
    EXPECT_EQ(x.lens_of, y.lens_of);
    EXPECT_EQ(x.lens.model(), y.lens.model());
    EXPECT_EQ(x.lens.size(), y.lens.size());
    EXPECT_EQ(x.lens.parameters(), y.lens.parameters());
    EXPECT_EQ(x.sensor_from_mount.rotation.coeffs(), y.sensor_from_mount.rotation.coeffs());
    EXPECT_EQ(x.sensor_from_mount.translation, y.sensor_from_mount.translation);
  }
  ASSERT_EQ(a.leds.size(), b.leds.size());
  for (std::size_t i = 0; i < a.leds.size(); ++i) {
    EXPECT_EQ(a.leds[i].name, b.leds[i].name);
    EXPECT_EQ(a.leds[i].mount, b.leds[i].mount);
    EXPECT_EQ(a.leds[i].position_mm, b.leds[i].position_mm);
  }
  EXPECT_EQ(a.sigma_px, b.sigma_px);
  EXPECT_EQ(a.scale_lacks, b.scale_lacks);
  EXPECT_EQ(a.doubts, b.doubts);
  EXPECT_EQ(a.rejected, b.rejected);
  EXPECT_EQ(a.covariance.names, b.covariance.names);
  EXPECT_EQ(a.covariance.matrix, b.covariance.matrix);
}

TEST(RigFile, IsReadBackExactly) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), example_rig()));
  const auto read = read_rig(home.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_same(*read, example_rig());
}

TEST(RigFile, WithTrackersAndLedsIsOfVersionTwoAndReadBackExactly) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), tracked_rig()));
  EXPECT_THAT(content_of(home / "rig.yaml"), HasSubstr("schema: crumple-rig/2"));
  const auto read = read_rig(home.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_same(*read, tracked_rig());
}

TEST(RigFile, WithoutEitherIsOfVersionOne) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), example_rig()));
  EXPECT_THAT(content_of(home / "rig.yaml"), HasSubstr("schema: crumple-rig/1"));
}

TEST(RigFile, WithAScaleIsOfVersionThreeAndKeepsWhatThatLacks) {
  const TemporaryFolder home;
  Rig rig = scaled_rig();
  ASSERT_TRUE(write_rig(home.path(), rig));
  EXPECT_THAT(content_of(home / "rig.yaml"),
              AllOf(HasSubstr("schema: crumple-rig/3"), testing::Not(HasSubstr("scale_lacks"))));
  expect_same(read_rig(home.path()).value(), rig);
  rig.scale_lacks = {"the expansion of board 'b' is not stated", "a \"second\": part"};
  ASSERT_TRUE(write_rig(home.path(), rig));
  const auto read = read_rig(home.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_same(*read, rig);
  replace_in(home / "rig.yaml", "crumple-rig/3", "crumple-rig/2");
  EXPECT_THAT(read_rig(home.path()).error().message, HasSubstr("scale_lacks: is new in crumple-rig/3"));
}

TEST(RigFile, WithDoubtsIsOfVersionFourAndReadBackExactly) {
  const TemporaryFolder home;
  Rig rig = example_rig();
  rig.doubts = {"cam: a \"bad\" view", "another: reason"};
  for (const bool rejected : {false, true}) {
    rig.rejected = rejected;
    ASSERT_TRUE(write_rig(home.path(), rig));
    const auto read = read_rig(home.path());
    ASSERT_TRUE(read) << read.error().message;
    expect_same(*read, rig);
  }
  replace_in(home / "rig.yaml", "crumple-rig/4", "crumple-rig/3");
  EXPECT_THAT(read_rig(home.path()).error().message, HasSubstr("verdict: is new in crumple-rig/4"));
}

// Complete, as far as such a file tells; but a file of that version told nothing.
TEST(RigFile, AScaleOfAnEarlierVersionIsNotTakenForComplete) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), scaled_rig()));
  replace_in(home / "rig.yaml", "crumple-rig/3", "crumple-rig/1");
  const auto read = read_rig(home.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(read->scale_lacks, testing::ElementsAre(HasSubstr("not recorded")));
  ASSERT_TRUE(write_rig(home.path(), *read));
  expect_same(read_rig(home.path()).value(), *read);
}

TEST(RigFile, NewKeysNeedTheirVersion) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), tracked_rig()));
  std::string text = content_of(home / "rig.yaml");
  text.replace(text.find("crumple-rig/2"), 13, "crumple-rig/1");
  std::ofstream(home / "rig.yaml") << text;
  const auto read = read_rig(home.path());
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, AllOf(HasSubstr("leds: is new in crumple-rig/2"),
                                          HasSubstr("sensor_from_world: is new in crumple-rig/2")));
}

TEST(RigFile, AnLedOfASensorsNameIsRefused) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), tracked_rig()));
  std::string text = content_of(home / "rig.yaml");
  text.replace(text.find("\"floor\""), 7, "\"cam0\"");
  std::ofstream(home / "rig.yaml") << text;
  const auto read = read_rig(home.path());
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("are named cam0"));
}

TEST(RigFile, LedsAreNamedOnce) {
  Rig rig = tracked_rig();
  rig.leds[1].name = "cam0";
  const TemporaryFolder home;
  const auto written = write_rig(home.path(), rig);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("named cam0"));
}

TEST(RigFile, WithoutCovarianceAndSigma) {
  const TemporaryFolder home;
  Rig rig = example_rig();
  rig.covariance = {};
  rig.sigma_px.clear();
  ASSERT_TRUE(write_rig(home.path(), rig));
  EXPECT_FALSE(std::filesystem::exists(home / "covariance.npy"));
  expect_same(read_rig(home.path()).value(), rig);
}

TEST(RigFile, NamesHoldAnyText) {
  const TemporaryFolder home;
  Rig rig = example_rig();
  rig.sigma_px = {{"line\nbreak \"quoted\" \\ \x01\x7f", 0.5}};
  ASSERT_TRUE(write_rig(home.path(), rig));
  const auto read = read_rig(home.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->sigma_px, rig.sigma_px);
}

TEST(RigFile, RefusesToWriteWhatCouldNotBeRead) {
  const TemporaryFolder home;
  const auto message = [&](auto&& change) {
    Rig rig = example_rig();
    change(rig);
    const auto written = write_rig(home.path(), rig);
    return written ? std::string("no error") : written.error().message;
  };
  EXPECT_THAT(message([](Rig& rig) { rig.sensors[0].name = "../cam"; }), HasSubstr("../cam"));
  EXPECT_THAT(message([](Rig& rig) { rig.sensors.clear(); }), HasSubstr("without sensors"));
  EXPECT_THAT(message([](Rig& rig) { rig.sensors[1].name = "cam0"; }), HasSubstr("Two sensors are named cam0"));
  EXPECT_THAT(message([](Rig& rig) { rig.sensors[1].sensor_from_mount.translation.x() = NAN; }), HasSubstr("proj-0"));
  EXPECT_THAT(message([](Rig& rig) { rig.sigma_px["cam0.corners"] = NAN; }), HasSubstr("cam0.corners"));
  EXPECT_THAT(message([](Rig& rig) { rig.covariance.matrix(0, 1) = NAN; }), HasSubstr("covariance"));
  EXPECT_THAT(message([](Rig& rig) { rig.covariance.matrix(0, 0) = -1; }), HasSubstr("cam0.fx"));
  EXPECT_THAT(message([](Rig& rig) { rig.covariance.names.pop_back(); }), HasSubstr("2 x 2"));
  EXPECT_THAT(message([](Rig& rig) { rig.scale_lacks = {""}; }), HasSubstr("without words"));
  EXPECT_EQ(home.entries(), 0);
}

struct Damage {
  std::string file;
  std::string old_text;
  std::string new_text;
  std::string said;
};

void PrintTo(const Damage& damage, std::ostream* stream) {
  *stream << damage.file << ": " << damage.old_text << " -> " << damage.new_text;
}

class DamagedRig : public testing::TestWithParam<Damage> {};

TEST_P(DamagedRig, IsRefusedNamingFileAndPlace) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_rig(home.path(), example_rig()));
  const Damage& damage = GetParam();
  ASSERT_THAT(content_of(home / damage.file), HasSubstr(damage.old_text));
  replace_in(home / damage.file, damage.old_text, damage.new_text);
  const auto read = read_rig(home.path());
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(damage.file));
  EXPECT_THAT(read.error().message, HasSubstr(damage.said));
}

INSTANTIATE_TEST_SUITE_P(RigFile, DamagedRig,
                         testing::Values(Damage{"rig.yaml", "crumple-rig/1", "crumple-rig/5", "schema"},
                                         Damage{"rig.yaml", "crumple-rig/1", "crumple-rig/3\nscale_lacks: []",
                                                "scale_lacks: must say something"},
                                         Damage{"rig.yaml", "length: mm", "length: m", "units.length"},
                                         Damage{"rig.yaml", "name: \"proj-0\"", "name: \"cam0\"", "two sensors"},
                                         Damage{"rig.yaml", "kind: projector", "kind: laser", "kind"},
                                         Damage{"rig.yaml", "[1, 0, 0, 0]", "[1, 0, 0]", "quaternion_wxyz"},
                                         Damage{"rig.yaml", "[1, 0, 0, 0]", "[1, 0, 0, 0.1]", "unit length"},
                                         Damage{"rig.yaml", "[1, 0, 0, 0]", "[.nan, 0, 0, 0]", "quaternion_wxyz"},
                                         Damage{"rig.yaml", "translation_mm", "translation_m", "translation_mm"},
                                         Damage{"rig.yaml", "[1280, 1024]", "[1280, 1023]", "cam0.cameramodel"},
                                         Damage{"rig.yaml", "\"cam0.cameramodel\"", "\"../cam0.cameramodel\"",
                                                "own folder"},
                                         Damage{"rig.yaml", "- \"cam0.fx\"\n", "", "2 x 2"},
                                         Damage{"rig.yaml", "0.1234567890123456", "-1", "sigma_px"},
                                         Damage{"rig.yaml", "0.1234567890123456", "1e300", "below 1e+12"},
                                         Damage{"proj-0.cameramodel", "-200", "-200.001", "pose"},
                                         Damage{"proj-0.cameramodel", "1900", "-1900", "proj-0.cameramodel"},
                                         Damage{"covariance.npy", "<f8", "<f4", "float64"}));

TEST(RigFile, MissingFilesAreNamed) {
  const TemporaryFolder home;
  EXPECT_THAT(read_rig(home / "none").error().message, HasSubstr("none/rig.yaml"));
  ASSERT_TRUE(write_rig(home.path(), example_rig()));
  std::filesystem::remove(home / "cam0.cameramodel");
  EXPECT_THAT(read_rig(home.path()).error().message, HasSubstr("cam0.cameramodel"));
}

}  // namespace
}  // namespace crumple
