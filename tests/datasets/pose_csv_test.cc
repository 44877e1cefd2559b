#include "datasets/pose_csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

std::string pose_error_of(const std::string& csv) {
  const auto poses = parse_pose_csv(csv, "hand.csv");
  return poses ? "" : poses.error().message;
}

TEST(PoseCsv, ReadsMetresAndQuaternionsWithTheRealPartLast) {
  const auto poses = parse_pose_csv(
      "t, x, y, z, qx, qy, qz, qw\n# a comment\n1491754391.5, 0.25, -1, 2e-3, 0.6, 0, 0, 0.8\r\n\n2e9,0,0,0,0,0,0,-1",
      "hand.csv");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 2U);
  const StampedPose& first = poses->front();
  EXPECT_EQ(first.time_s, 1491754391.5);
  EXPECT_LT((first.fixed_from_moving.translation - Eigen::Vector3d(250, -1000, 2)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(first.fixed_from_moving.rotation.x(), 0.6);
  EXPECT_DOUBLE_EQ(first.fixed_from_moving.rotation.w(), 0.8);
  EXPECT_EQ(poses->back().fixed_from_moving.rotation.w(), -1);
}

TEST(PoseCsv, NamesTheLineAndWhatIsWrongWithIt) {
  const std::string good = "1, 0, 0, 0, 0, 0, 0, 1\n";
  EXPECT_THAT(pose_error_of(good + "2, 0, 0, 0, 0, 0, 1\n"), testing::StartsWith("hand.csv:2: has 7 fields, not 8"));
  EXPECT_THAT(pose_error_of(good + "2, 0, nan, 0, 0, 0, 0, 1\n"), testing::HasSubstr("hand.csv:2: 'nan' is no number"));
  EXPECT_THAT(pose_error_of(good + "2, 0, 1 2, 0, 0, 0, 0, 1\n"), testing::HasSubstr("'1 2' is no number"));
  EXPECT_THAT(pose_error_of(good + "2, 0, 0, 0, 0, 0, 0.1, 1\n"),
              testing::HasSubstr("quaternion has the length 1.00499"));
  EXPECT_THAT(pose_error_of(good + "0.5, 0, 0, 0, 0, 0, 0, 1\n"), testing::HasSubstr("hand.csv:2: is older"));
  EXPECT_THAT(pose_error_of(good + "time, 0, 0, 0, 0, 0, 0, 1\n"), testing::HasSubstr("hand.csv:2: 'time'"));
}

std::string list_error_of(const std::string& csv) {
  const auto poses = parse_pose_list(csv, "poses.csv");
  return poses ? "" : poses.error().message;
}

// Numbers that count down, and no times at all.
TEST(PoseCsv, TimesOfAListSayNothing) {
  const auto poses = parse_pose_list(
      "n, x, y, z, qx, qy, qz, qw\n# a comment\n2, 0.25, -1, 2e-3, 0.6, 0, 0, 0.8\n1, 1, 0, 0, 0, 0, 0, 1\n"
      "0, 2, 0, 0, 0, 0, 0, 1\n0, 3, 0, 0, 0, 0, 0, 1\n",
      "arm.csv");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 4U);
  EXPECT_LT((poses->front().translation - Eigen::Vector3d(250, -1000, 2)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(poses->front().rotation.x(), 0.6);
  EXPECT_EQ(poses->back().translation.x(), 3000);
  EXPECT_THAT(list_error_of("now, 0, 0, 0, 0, 0, 0, 1\n, 0, 0, 0, 0, 0, 0, 1\n"),
              testing::HasSubstr("poses.csv:2: '' is no number"));
}

// Millimetres, by stations, one of which has the name of a comment.
TEST(PoseCsv, AListMayBePosesCsvOfTrack) {
  const std::string columns = kStationPoseColumns;
  const auto poses = parse_pose_list(columns +
                                         ",c00,c01\n#1,250,-1000,2,0.6,0,0,0.8,1e-9,0\n"
                                         "two,1,2,3,0,0,0,-1,1e-9,0\n",
                                     "poses.csv");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_LT((poses->front().translation - Eigen::Vector3d(250, -1000, 2)).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(poses->front().rotation.w(), 0.8);
  EXPECT_EQ(poses->back().translation.z(), 3);
  EXPECT_EQ(parse_pose_list(columns + "\none,1,2,3,0,0,0,1\n", "poses.csv").value().size(), 1U);
  EXPECT_EQ(list_error_of(columns + ",c00\none,1,2,3,0,0,0,1\n"), "poses.csv:2: has 8 fields, the first line 9");
  EXPECT_THAT(list_error_of(columns + "\none,1,2,3,0,0,0,1\ntwo,1,2,3,0,0,0,1.1\n"),
              testing::AllOf(testing::StartsWith("poses.csv:3: "), testing::HasSubstr("length 1.1")));
}

TEST(PoseCsv, PosesOfTrackAreNoStream) {
  EXPECT_THAT(pose_error_of(std::string(kStationPoseColumns) + "\none,1,2,3,0,0,0,1\n"),
              testing::AllOf(testing::HasSubstr("has no times"), testing::HasSubstr("--paired")));
}

TEST(PoseCsv, AStreamNeedsTwoPoses) {
  const TemporaryFolder folder;
  write_content(folder / "eye.csv", "1, 0, 0, 0, 0, 0, 0, 1\n");
  const auto stream = read_pose_stream(folder / "eye.csv");
  ASSERT_FALSE(stream);
  EXPECT_THAT(stream.error().message, testing::HasSubstr("eye.csv: a stream needs at least two poses"));
  EXPECT_FALSE(read_pose_stream(folder / "none.csv"));
  EXPECT_EQ(read_pose_list(folder / "eye.csv").value().size(), 1U);
  EXPECT_FALSE(read_pose_list(folder / "none.csv"));
}

}  // namespace
}  // namespace crumple
