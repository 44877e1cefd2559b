// `crumple calibrate --hand_eye` from two files to its verdict.
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/npy_file.h"
#include "datasets/pose_csv.h"
#include "tests/cli/program.h"
#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

std::string csv_of(const std::vector<StampedPose>& poses) {
  std::string text;
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d t = 1e-3 * pose.fixed_from_moving.translation;
    const Eigen::Quaterniond& q = pose.fixed_from_moving.rotation;
    text +=
        fmt::format("{}, {}, {}, {}, {}, {}, {}, {}\n", pose.time_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

ProgramRun run_in(const TemporaryFolder& folder, const std::string& arguments) {
  return run_program("calibrate --hand_eye " + arguments, "cd '" + folder.path().string() + "' &&");
}

class HandEyeProgram : public testing::Test {
 protected:
  HandEyeProgram() {
    std::mt19937 random(1);
    made_ = make_streams({.offset_s = 0.123, .eye_sigma_deg = 0.05, .eye_sigma_mm = 0.3}, random);
    write_content(folder_ / "hand.csv", csv_of(made_.hand));
    write_content(folder_ / "eye.csv", csv_of(made_.eye));
  }

  ProgramRun run(const std::string& arguments) const { return run_in(folder_, arguments); }

  TemporaryFolder folder_;
  MadeStreams made_;
};

TEST_F(HandEyeProgram, WritesPoseCovarianceAndSummary) {
  const ProgramRun done = run("hand.csv eye.csv --out=out");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_THAT(done.out, testing::HasSubstr("verdict: ok"));
  EXPECT_THAT(done.out, testing::HasSubstr("time offset: 12"));
  const auto summary = nlohmann::json::parse(content_of(folder_ / "out/summary.json"));
  EXPECT_EQ(summary["schema"], "crumple-hand-eye-summary/1");
  EXPECT_NEAR(summary["time_offset"]["offset_s"].get<double>(), 0.123, 5e-4);
  EXPECT_EQ(summary["paired"], false);
  EXPECT_TRUE(summary.contains("hand") && summary.contains("eye"));
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double found = summary["hand_from_eye"]["translation_mm"][static_cast<std::size_t>(i)];
    const double sigma = summary["hand_from_eye"]["translation_sigma_mm"][static_cast<std::size_t>(i)];
    EXPECT_NEAR(found, made_.hand_from_eye.translation[i], 5 * sigma);
  }
  EXPECT_THAT(content_of(folder_ / "out/hand_eye.yaml"), testing::StartsWith("schema: crumple-hand-eye/1\n"));
  const auto covariance = read_npy(folder_ / "out/covariance.npy");
  ASSERT_TRUE(covariance);
  EXPECT_EQ(covariance->rows(), 13);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/ro-crate-metadata.json"));
}

TEST_F(HandEyeProgram, ReadsInvertedPosesWhenTold) {
  for (StampedPose& pose : made_.eye) pose.fixed_from_moving = pose.fixed_from_moving.inverse();
  write_content(folder_ / "inverted.csv", csv_of(made_.eye));
  const ProgramRun wrong = run("hand.csv inverted.csv --out=out");
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_THAT(wrong.err, testing::HasSubstr("the other way round"));
  EXPECT_EQ(run("hand.csv inverted.csv --invert=eye --out=out").exit_code, 0);
}

TEST_F(HandEyeProgram, SaysWhatIsWrongWithTheCommandLineAndTheInput) {
  EXPECT_EQ(run("hand.csv --out=out").exit_code, 2);
  EXPECT_EQ(run("hand.csv eye.csv --warp=on --out=out").exit_code, 2);
  EXPECT_EQ(run("hand.csv eye.csv --invert=board --out=out").exit_code, 2);
  for (const std::string name : {"report", "starts", "suggest=2"}) {
    const ProgramRun refused = run("hand.csv eye.csv --" + name + " --out=out");
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.err, testing::HasSubstr("--" + name.substr(0, name.find('=')) + " is about captures"));
  }
  write_content(folder_ / "bad.csv", "1, 2, 3\n");
  const ProgramRun bad = run("hand.csv bad.csv --out=out");
  EXPECT_EQ(bad.exit_code, 3);
  EXPECT_THAT(bad.err, testing::HasSubstr("bad.csv:1: has 3 fields, not 8"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

// The eye moves freely and turns about one axis: where it is along that nothing tells.
TEST_F(HandEyeProgram, RefusesTurnsAboutOneAxis) {
  const auto eye_from_board = [](double t) {
    const double turn_rad = 0.5 * std::sin(0.5 * t + 0.06 * t * t) + 0.2 * std::sin(2.3 * t);
    return Pose{rotation_from_vector(turn_rad * Eigen::Vector3d(0.6, 0, 0.8)),
                {60 * std::sin(1.3 * t), 50 * std::sin(0.9 * t), 900 + 40 * std::sin(1.7 * t)}};
  };
  std::vector<StampedPose> hand, eye;
  for (double t = -0.5; t < 20.5; t += 0.01) {
    hand.push_back({t, made_.world_from_board * eye_from_board(t).inverse() * made_.hand_from_eye.inverse()});
  }
  for (double t = 0; t < 20; t += 1.0 / 30) eye.push_back({t, eye_from_board(t).inverse()});
  write_content(folder_ / "one_axis_hand.csv", csv_of(hand));
  write_content(folder_ / "one_axis_eye.csv", csv_of(eye));
  const ProgramRun refused = run("one_axis_hand.csv one_axis_eye.csv --out=out");
  EXPECT_EQ(refused.exit_code, 3) << refused.out;
  EXPECT_THAT(refused.err, testing::HasSubstr("axes are parallel"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

// As poses.csv of `crumple track` has them.
std::string station_csv_of(const std::vector<StampedPose>& poses) {
  std::string text = fmt::format("{},c00,c01\n", kStationPoseColumns);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& t = poses[i].fixed_from_moving.translation;
    const Eigen::Quaterniond& q = poses[i].fixed_from_moving.rotation;
    text += fmt::format("#{},{},{},{},{},{},{},{},1e-8,0\n", i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

// An arm that goes and stops: twelve poses of its flange and twelve of its camera, in two files.
class PairedLists : public testing::Test {
 protected:
  PairedLists() {
    std::mt19937 random(5);
    made_ = make_hand_eye(
        {.poses = 12, .hand_sigma_deg = 0.01, .hand_sigma_mm = 0.1, .eye_sigma_deg = 0.05, .eye_sigma_mm = 0.3},
        random);
    for (const PosePair& pair : made_.pairs) {
      hand_.push_back({pair.time_s, pair.world_from_hand});
      eye_.push_back({pair.time_s, pair.board_from_eye});
    }
    write();
  }

  void write() const {
    write_content(folder_ / "arm.csv", csv_of(hand_));
    write_content(folder_ / "camera.csv", csv_of(eye_));
  }

  ProgramRun run(const std::string& arguments) const { return run_in(folder_, arguments); }

  void expect_found(const nlohmann::json& summary) const {
    EXPECT_EQ(summary["pairs"], 12);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double found = summary["hand_from_eye"]["translation_mm"][static_cast<std::size_t>(i)];
      const double sigma = summary["hand_from_eye"]["translation_sigma_mm"][static_cast<std::size_t>(i)];
      EXPECT_LT(sigma, 5);
      EXPECT_NEAR(found, made_.hand_from_eye.translation[i], 5 * sigma);
    }
  }

  TemporaryFolder folder_;
  MadeHandEye made_;
  std::vector<StampedPose> hand_, eye_;
};

// No times on one side, numbers that count down on the other.
TEST_F(PairedLists, NeedNoTimes) {
  for (StampedPose& pose : hand_) pose.time_s = 0;
  for (StampedPose& pose : eye_) pose.time_s = 100 - pose.time_s;
  write();
  const ProgramRun done = run("arm.csv camera.csv --paired --out=out");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_THAT(done.out, testing::HasSubstr("\npaired: "));
  EXPECT_THAT(done.out, testing::Not(testing::HasSubstr("time offset")));
  const auto summary = nlohmann::json::parse(content_of(folder_ / "out/summary.json"));
  expect_found(summary);
  EXPECT_EQ(summary["paired"], true);
  for (const char* key : {"time_offset", "hand", "eye"}) EXPECT_FALSE(summary.contains(key)) << key;
  EXPECT_THAT(content_of(folder_ / "out/hand_eye.yaml"), testing::Not(testing::HasSubstr("time_offset")));
  EXPECT_EQ(read_npy(folder_ / "out/covariance.npy").value().rows(), 12);
}

TEST_F(PairedLists, MayBeInverted) {
  for (StampedPose& pose : eye_) pose.fixed_from_moving = pose.fixed_from_moving.inverse();
  write();
  const ProgramRun done = run("arm.csv camera.csv --paired --invert=eye --json --out=out");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  expect_found(nlohmann::json::parse(done.out));
}

TEST_F(PairedLists, MustHaveEquallyManyPoses) {
  eye_.erase(eye_.begin() + 4);
  write();
  const ProgramRun refused = run("arm.csv camera.csv --paired --out=out");
  EXPECT_EQ(refused.exit_code, 3) << refused.out;
  EXPECT_THAT(refused.err, testing::HasSubstr("arm.csv has 12 poses and camera.csv has 11"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

// Too few for an offset of clocks: the sentence says what they may be.
TEST_F(PairedLists, AreHintedAtWhereNoOffsetIsTold) {
  const ProgramRun refused = run("arm.csv camera.csv --out=out");
  EXPECT_EQ(refused.exit_code, 3) << refused.out;
  EXPECT_THAT(refused.err,
              testing::AllOf(testing::HasSubstr("the time offset cannot be told"), testing::HasSubstr("--paired")));
  for (StampedPose& pose : hand_) pose.time_s = 0;
  write();
  EXPECT_THAT(run("arm.csv camera.csv --out=out").err,
              testing::AllOf(testing::HasSubstr("at different times"), testing::HasSubstr("--paired")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

// Poses of the hand from `crumple track`: in mm, and without times.
TEST_F(PairedLists, MayBeThoseOfTrack) {
  write_content(folder_ / "poses.csv", station_csv_of(hand_));
  const ProgramRun done = run("poses.csv camera.csv --paired --json --out=out");
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  expect_found(nlohmann::json::parse(done.out));
  const ProgramRun refused = run("poses.csv camera.csv --out=without");
  EXPECT_EQ(refused.exit_code, 3) << refused.out;
  EXPECT_THAT(refused.err, testing::AllOf(testing::HasSubstr("poses.csv: is poses.csv of `crumple track`"),
                                          testing::HasSubstr("--paired")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "without"));
}

TEST_F(PairedLists, AreOfHandAndEye) {
  const ProgramRun refused = run_program("calibrate capture.yaml --paired --out=out");
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  EXPECT_THAT(refused.err, testing::HasSubstr("--paired is about poses"));
}

TEST_F(HandEyeProgram, DoubtsNoisyPoses) {
  std::mt19937 random(2);
  const MadeStreams noisy =
      make_streams({.seconds = 6, .eye_sigma_deg = 5, .eye_sigma_mm = 60, .eye_correlation = 0.9}, random);
  write_content(folder_ / "noisy_hand.csv", csv_of(noisy.hand));
  write_content(folder_ / "noisy_eye.csv", csv_of(noisy.eye));
  const ProgramRun doubted = run("noisy_hand.csv noisy_eye.csv --out=out");
  EXPECT_EQ(doubted.exit_code, 4) << doubted.err << doubted.out;
  EXPECT_THAT(doubted.out, testing::HasSubstr("verdict: suspect\n  "));
}

}  // namespace
}  // namespace crumple
