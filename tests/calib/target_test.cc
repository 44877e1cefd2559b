#include "calib/target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/aruco/charuco.hpp>

#include "calib/dictionary.h"
#include "calib/target_print.h"

namespace crumple {
namespace {

using testing::HasSubstr;

// OpenCV's own board: a second opinion on which marker is where.
TEST(Target, CharucoBoardsAreOpenCvs) {
  const Target target{8, 5, 20, TargetKind::charuco, 14, "5X5_100"};
  const auto peer = cv::aruco::CharucoBoard::create(9, 6, 20, 14, cv::aruco::getPredefinedDictionary(5));
  const auto markers = markers_of(target);
  ASSERT_EQ(markers.size(), peer->ids.size());
  // Its origin is the outer corner of the first square.
  for (std::size_t i = 0; i < markers.size(); ++i) {
    EXPECT_EQ(markers[i].id, peer->ids[i]);
    const auto corners = marker_corners_mm(markers[i], target.mark_mm);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(corners[k].x() + 20, peer->objPoints[i][k].x, 1e-4);
      EXPECT_NEAR(corners[k].y() + 20, peer->objPoints[i][k].y, 1e-4);
    }
  }
  const Board board = board_of(target);
  ASSERT_EQ(static_cast<std::size_t>(board.point_count()), peer->chessboardCorners.size());
  for (int i = 0; i < board.point_count(); ++i) {
    const cv::Point3f& corner = peer->chessboardCorners[static_cast<std::size_t>(i)];
    EXPECT_NEAR(board.point(i).x() + 20, corner.x, 1e-4);
    EXPECT_NEAR(board.point(i).y() + 20, corner.y, 1e-4);
  }
}

TEST(Target, PointsOfMarkersAreTheirCorners) {
  const Target target{3, 2, 30, TargetKind::apriltag, 24, "APRILTAG_36h11"};
  const Board board = board_of(target, "tags");
  EXPECT_EQ(board.name, "tags");
  EXPECT_EQ(board.point_count(), 24);
  EXPECT_EQ(board.point(2), Eigen::Vector3d(24, 24, 0));
  EXPECT_EQ(board.point(4 * 4 + 3), Eigen::Vector3d(30, 54, 0));
}

TEST(Target, StaggeredDotsStandInTheGaps) {
  const Board board = board_of({4, 3, 30, TargetKind::dots, 10, {}, 0, true});
  EXPECT_EQ(board.point(4), Eigen::Vector3d(15, 15, 0));
  EXPECT_EQ(board.point(8), Eigen::Vector3d(0, 30, 0));
  EXPECT_EQ(board.disc_radius_mm(), 5);
}

TEST(Target, SaysWhyItCannotBeMade) {
  const auto reason = [](const Target& target) {
    const auto sound = checked(target);
    return sound ? std::string("sound") : sound.error().message;
  };
  EXPECT_EQ(reason({9, 6, 25}), "sound");
  EXPECT_THAT(reason({1, 6, 25}), HasSubstr("1 x 6"));
  EXPECT_THAT(reason({9, 6, -1}), HasSubstr("pitch"));
  EXPECT_THAT(reason({9, 6, 25, TargetKind::charuco, 18, "5x5"}), HasSubstr("no dictionary"));
  EXPECT_THAT(reason({20, 20, 25, TargetKind::charuco, 18, "5X5_100"}), HasSubstr("0 to 99"));
  EXPECT_THAT(reason({9, 6, 25, TargetKind::charuco, 24.5, "5X5_100"}), HasSubstr("of white beside them"));
  EXPECT_THAT(reason({9, 6, 25, TargetKind::dots, 20}), HasSubstr("up to 17.50 mm"));
  EXPECT_THAT(reason({6, 6, 25, TargetKind::dots, 10}), HasSubstr("four sides"));
}

TEST(Target, MarkersOfTwoBoardsMayMeet) {
  const Target a{9, 6, 25, TargetKind::charuco, 18, "5X5_100"};  // 35 markers
  Target b = a;
  b.first_id = 34;
  EXPECT_TRUE(share_markers(a, b));
  b.first_id = 35;
  EXPECT_FALSE(share_markers(a, b));
  b = a;
  b.dictionary = "5X5_50";
  EXPECT_FALSE(share_markers(a, b));
  EXPECT_FALSE(share_markers({9, 6, 25}, {9, 6, 25}));
}

TEST(Target, BoardsWithoutMarkersMayLookAlike) {
  EXPECT_TRUE(look_alike({9, 6, 25}, {9, 6, 30}));
  EXPECT_TRUE(look_alike({9, 6, 25}, {6, 9, 25}));  // turned
  EXPECT_FALSE(look_alike({9, 6, 25}, {9, 7, 25}));
  EXPECT_FALSE(look_alike({9, 6, 25}, {9, 6, 25, TargetKind::dots, 10}));
  const Target dots{9, 6, 25, TargetKind::dots, 8};
  Target staggered = dots;
  staggered.staggered = true;
  EXPECT_FALSE(look_alike(dots, staggered));
  EXPECT_TRUE(look_alike(staggered, staggered));
  const Target coded{9, 6, 25, TargetKind::charuco, 18, "5X5_100"};
  EXPECT_FALSE(look_alike(coded, coded));  // share_markers() is about these
}

TEST(TargetPrint, ChessboardsAreDarkOutsideTheirFirstCorner) {
  const TargetPrint print(Target{9, 6, 25});
  EXPECT_TRUE(print.dark({-1, -1}));
  EXPECT_FALSE(print.dark({1, -1}));
  EXPECT_TRUE(print.dark({1, 1}));
  EXPECT_FALSE(print.dark({-26, -1}));
  EXPECT_EQ(print.extent().high_mm, Eigen::Vector2d(225, 150));
}

TEST(TargetPrint, AMarkersCornerIsACrossingOfEdges) {
  const TargetPrint print(Target{3, 2, 30, TargetKind::apriltag, 24, "APRILTAG_36h11"});
  EXPECT_TRUE(print.dark({24.1, 24.1}));
  EXPECT_TRUE(print.dark({23.9, 23.9}));
  EXPECT_FALSE(print.dark({24.1, 23.9}));
  EXPECT_FALSE(print.dark({23.9, 24.1}));
}

}  // namespace
}  // namespace crumple
