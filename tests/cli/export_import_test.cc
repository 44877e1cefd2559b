// export and import through the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/formats/rig_format.h"
#include "datasets/rig_file.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class ExportImport : public testing::Test {
 protected:
  void make_rig(const std::string& model) {
    std::vector<double> parameters(lens_parameter_names(model).size());
    parameters[0] = 900.25;
    parameters[1] = 901.5;
    parameters[2] = 320;
    parameters[3] = 240;
    if (parameters.size() > 4) parameters[4] = -0.1;
    const Lens lens = Lens::create(model, {640, 480}, parameters).value();
    rig_.sensors = {{"left", SensorKind::camera, lens, {}},
                    {"right", SensorKind::camera, lens, {rotation_from_vector({0, -0.1, 0}), {-120, 3, 5}}},
                    {"beamer", SensorKind::projector, lens, {rotation_from_vector({0.2, 0, 0}), {0, 150, 9}}}};
    std::filesystem::create_directory(home_ / "rig");
    ASSERT_TRUE(write_rig(home_ / "rig", rig_));
  }

  std::string path(const std::string& name) const { return "'" + (home_ / name).string() + "'"; }

  TemporaryFolder home_;
  Rig rig_;
};

TEST_F(ExportImport, ARigThatWasNotTrustedIsNotPassedOnInSilence) {
  make_rig("LENSMODEL_OPENCV4");
  rig_.doubts = {"left: the focal length is known to 12.0 % only"};
  for (const bool rejected : {false, true}) {
    rig_.rejected = rejected;
    ASSERT_TRUE(write_rig(home_ / "rig", rig_));
    const std::string level = rejected ? "rejected" : "suspect";
    const ProgramRun run = run_program("export " + path("rig") + " --format=mrcal --out=" + path(level));
    EXPECT_EQ(run.exit_code, rejected ? 4 : 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("the rig was " + level + " when calibrated: left: the focal length is known to"));
    EXPECT_TRUE(std::filesystem::exists(home_ / level / "left.cameramodel"));
  }
}

TEST_F(ExportImport, EveryFormatThereAndBack) {
  make_rig("LENSMODEL_OPENCV4");
  for (const RigFormat& format : rig_formats()) {
    const std::string flags = " --format=" + format.name + " --json --out=";
    const ProgramRun out = run_program("export " + path("rig") + flags + path(format.name));
    ASSERT_EQ(out.exit_code, 0) << out.err;
    const json exported = json::parse(out.out);
    EXPECT_EQ(exported["format"], format.name);
    for (const json& file : exported["files"]) {
      EXPECT_TRUE(std::filesystem::exists(home_ / format.name / file.get<std::string>()));
    }
    EXPECT_TRUE(std::filesystem::exists(home_ / format.name / "ro-crate-metadata.json"));
    const std::string unit = format.lengths.empty() ? " --unit=mm" : "";
    const ProgramRun in = run_program("import " + path(format.name) + unit + flags + path(format.name + "_back"));
    ASSERT_EQ(in.exit_code, 0) << in.err;
    const auto read = read_rig(home_ / (format.name + "_back"));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(json::parse(in.out)["sensors"].size(), read->sensors.size());
    for (const Sensor& camera : {rig_.sensors[0], rig_.sensors[1]}) {
      const Sensor& again = read->sensors[read->find(camera.name).value()];
      const Eigen::Vector3d point(40, -30, 700);
      EXPECT_LT((*again.lens.project(again.sensor_from_mount * point) -
                 *camera.lens.project(camera.sensor_from_mount * point))
                    .norm(),
                1e-9)
          << format.name;
    }
    EXPECT_TRUE(read->covariance.names.empty());
  }
}

// No pose between the probe and the world is fixed: written side by side they would look like neighbours.
TEST_F(ExportImport, ATrackedRigIsWrittenByOneMount) {
  make_rig("LENSMODEL_OPENCV4");
  Sensor tracker = rig_.sensors[1];
  tracker.name = "tracker";
  tracker.mount = Mount::world;
  tracker.sensor_from_mount = {};
  Sensor moved = tracker;
  moved.name = "moved";
  moved.lens_of = rig_.sensors.size();
  moved.sensor_from_mount.translation = {900, 0, 40};
  rig_.sensors.push_back(tracker);
  rig_.sensors.push_back(moved);
  rig_.leds = {{"a", {10, 20, 30}}};
  std::filesystem::create_directory(home_ / "tracked");
  ASSERT_TRUE(write_rig(home_ / "tracked", rig_));
  const std::string command = "export " + path("tracked") + " --format=opencv --json --out=" + path("cv");
  const ProgramRun both = run_program(command);
  EXPECT_EQ(both.exit_code, 3);
  EXPECT_THAT(both.err, AllOf(HasSubstr("left, right, beamer on the probe and tracker, moved fixed to the world"),
                              HasSubstr("--mount=probe or --mount=world")));
  EXPECT_FALSE(std::filesystem::exists(home_ / "cv"));
  EXPECT_EQ(run_program(command + " --mount=roof").exit_code, 2);
  const ProgramRun world = run_program(command + " --mount=world");
  ASSERT_EQ(world.exit_code, 0) << world.err;
  EXPECT_EQ(json::parse(world.out)["files"], json::array({"moved.yml", "tracker.yml"}));
  EXPECT_THAT(world.out, HasSubstr("the LEDs"));
  const ProgramRun probe = run_program(command + " --overwrite --mount=probe");
  ASSERT_EQ(probe.exit_code, 0) << probe.err;
  EXPECT_EQ(json::parse(probe.out)["files"], json::array({"beamer.yml", "left.yml", "right.yml"}));
  EXPECT_EQ(run_program("export " + path("rig") + " --format=opencv --mount=world --out=" + path("none")).exit_code, 3);
}

TEST_F(ExportImport, UnitsAreAskedForWhereTheFormatHasNone) {
  make_rig("LENSMODEL_OPENCV5");
  ASSERT_EQ(run_program("export " + path("rig") + " --format=opencv --unit=m --out=" + path("cv")).exit_code, 0);
  const ProgramRun without = run_program("import " + path("cv") + " --format=opencv --out=" + path("back"));
  EXPECT_EQ(without.exit_code, 2);
  EXPECT_THAT(without.err, HasSubstr("states no unit of length: give --unit=mm, cm or m"));
  EXPECT_FALSE(std::filesystem::exists(home_ / "back"));
  ASSERT_EQ(run_program("import " + path("cv") + " --format=opencv --unit=m --out=" + path("back")).exit_code, 0);
  const Rig read = read_rig(home_ / "back").value();
  EXPECT_NEAR(read.sensors[read.find("right").value()].sensor_from_mount.translation.x(), -120, 1e-10);
  // One camera at the reference has no lengths.
  const ProgramRun one = run_program("import " + path("cv/left.yml") + " --format=opencv --out=" + path("one"));
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.out, HasSubstr("left (LENSMODEL_OPENCV5): 640 x 480 px"));
}

TEST_F(ExportImport, MistakesOfTheCommandLine) {
  make_rig("LENSMODEL_OPENCV5");
  const auto said = [&](const std::string& arguments) {
    const ProgramRun run = run_program(arguments + " --out=" + path("out"));
    EXPECT_EQ(run.exit_code, 2) << arguments;
    EXPECT_FALSE(std::filesystem::exists(home_ / "out"));
    return run.err;
  };
  EXPECT_THAT(said("export " + path("rig")), HasSubstr("export needs --format"));
  EXPECT_THAT(said("export " + path("rig") + " --format=kalibra"), HasSubstr("opencv, kalibr, ros, colmap, mrcal"));
  EXPECT_THAT(said("export " + path("rig") + " --format=kalibr --unit=m"),
              HasSubstr("lengths of --format=kalibr are m"));
  EXPECT_THAT(said("export " + path("rig") + " --format=opencv --unit=inch"), HasSubstr("none of mm, cm and m"));
  EXPECT_THAT(said("import --format=opencv"), HasSubstr("import needs 1 input"));
}

TEST_F(ExportImport, BadInputEndsWithASentenceAndNothingWritten) {
  make_rig("LENSMODEL_OPENCV5");
  const auto said = [&](const std::string& arguments) {
    const ProgramRun run = run_program(arguments + " --out=" + path("out"));
    EXPECT_EQ(run.exit_code, 3) << arguments;
    EXPECT_FALSE(std::filesystem::exists(home_ / "out"));
    EXPECT_EQ(home_.entries(), 1);
    return run.err;
  };
  EXPECT_THAT(said("export " + path("none") + " --format=opencv"), HasSubstr("none/rig.yaml does not exist."));
  EXPECT_THAT(said("export " + path("rig") + " --format=kalibr"),
              AllOf(HasSubstr("left has the lens model LENSMODEL_OPENCV5"), HasSubstr("a camchain of Kalibr's"),
                    HasSubstr("LENSMODEL_PINHOLE and LENSMODEL_OPENCV4")));
  EXPECT_THAT(said("import " + path("none") + " --format=kalibr"), HasSubstr("none does not exist."));
  EXPECT_THAT(said("import " + path("rig") + " --format=opencv"), HasSubstr("holds no .yml file."));
  EXPECT_THAT(said("import " + path("rig/rig.yaml") + " --format=kalibr"), HasSubstr("no cam0"));
  write_content(home_ / "rig/placements.yaml", "schema: other\n");
  EXPECT_THAT(said("export " + path("rig") + " --format=mrcal"), HasSubstr("placements.yaml:1:9: schema"));
}

TEST_F(ExportImport, WhatIsLeftBehindIsSaid) {
  make_rig("LENSMODEL_PINHOLE");
  const ProgramRun kalibr = run_program("export " + path("rig") + " --format=kalibr --out=" + path("chain"));
  EXPECT_THAT(kalibr.out, AllOf(HasSubstr("chain/camchain.yaml\n"), HasSubstr("left behind: projector beamer")));
  const ProgramRun mrcal = run_program("export " + path("rig") + " --format=mrcal --out=" + path("models"));
  EXPECT_THAT(mrcal.out, HasSubstr("left behind: the optimization's inputs: the rig's folder holds no observations"));
}

}  // namespace
}  // namespace crumple
