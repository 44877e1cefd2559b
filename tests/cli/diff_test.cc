// diff through the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/rig_file.h"
#include "datasets/run_record.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using testing::HasSubstr;

const std::string kRig = CRUMPLE_SOURCE_DIR "/tests/data/rigs/version_1";

TEST(DiffVerb, FindsNoDifferenceOfARigAndItself) {
  const ProgramRun run = run_program("diff " + kRig + " " + kRig);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("no difference beyond both uncertainties, at k = 2 over 3 tests"));
}

TEST(DiffVerb, NamesWhatMovedAndWritesIt) {
  const TemporaryFolder home;
  Rig rig = read_rig(kRig).value();
  Pose& pose = rig.sensors[1].sensor_from_mount;
  pose = retract(pose, (Vector6d() << 0, 0.005, 0, 0, 0, 0).finished());
  std::filesystem::create_directory(home / "nudged");
  ASSERT_TRUE(write_rig(home / "nudged", rig));
  const std::string nudged = "'" + (home / "nudged").string() + "'", out = "'" + (home / "out").string() + "'";
  const ProgramRun run = run_program("diff " + kRig + " " + nudged + " --json --k=3 --out=" + out);
  EXPECT_EQ(run.exit_code, 4) << run.err;
  const auto document = nlohmann::json::parse(run.out);
  EXPECT_TRUE(document["significant"]);
  ASSERT_EQ(document["changed"].size(), 1u);
  EXPECT_EQ(document["changed"][0], "proj0 has moved against cam0");
  EXPECT_NEAR(document["pairs"][0]["turned_deg"].get<double>(), 0.2865, 1e-3);
  EXPECT_EQ(nlohmann::json::parse(content_of(home / "out/summary.json")), document);
  for (const char* name : {"projection_cam0.csv", "projection_proj0.png", "volume_cam0+proj0.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(home / "out" / name)) << name;
  }
}

// Of two rigs from one image nothing says that they are independent.
TEST(DiffVerb, SaysThatTheSameFilesWentIntoBothRigs) {
  const TemporaryFolder home;
  write_content(home / "image.png", "an image");
  const Rig rig = read_rig(kRig).value();
  for (const char* name : {"a", "b"}) {
    std::filesystem::create_directory(home / name);
    ASSERT_TRUE(write_rig(home / name, rig));
    ASSERT_TRUE(write_run_record(
        home / name, {"1.2.3", "calibrate", "2024-05-06", {}, {}, hashed_files({home / "image.png"}).value()}));
  }
  const std::string both = "diff '" + (home / "a").string() + "' '" + (home / "b").string() + "'";
  const ProgramRun run = run_program(both + " --json");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(
      nlohmann::json::parse(run.out)["not_independent"],
      HasSubstr("the same files went into both (1 in common, the first " + (home / "image.png").string() + ")"));

  write_content(home / "b/ro-crate-metadata.json", "{");
  const ProgramRun damaged = run_program(both);
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("ro-crate-metadata.json is not a run record"));
}

TEST(DiffVerb, SaysWhichFlagsComparePairsWhoseAxesDoNotMeet) {
  const TemporaryFolder home;
  Rig rig = read_rig(kRig).value();
  Pose& pose = rig.sensors[1].sensor_from_mount;
  const Pose turn{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitY())), Eigen::Vector3d::Zero()};
  pose = turn * pose;
  std::filesystem::create_directory(home / "turned");
  ASSERT_TRUE(write_rig(home / "turned", rig));
  const std::string turned = "'" + (home / "turned").string() + "' ";
  const ProgramRun run = run_program("diff " + turned + turned);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("not compared: cam0 and proj0: their axes do not meet"));
  EXPECT_THAT(run.out, HasSubstr("say with --near_mm and --far_mm where pairs measure"));
}

TEST(DiffVerb, RefusesWhatCannotBeCompared) {
  const ProgramRun half = run_program("diff " + kRig + " " + kRig + " --near_mm=500");
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_THAT(half.err, HasSubstr("--far_mm"));
  const ProgramRun bare = run_program("diff " + kRig + " " CRUMPLE_SOURCE_DIR "/tests/data/rigs/version_2");
  EXPECT_EQ(bare.exit_code, 3);
  EXPECT_THAT(bare.err, HasSubstr("the second rig has no covariance"));
}

}  // namespace
}  // namespace crumple
