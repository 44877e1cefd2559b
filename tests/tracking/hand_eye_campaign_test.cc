#include "tests/tracking/hand_eye_campaign.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

// A part of `./dev bench hand_eye`.
TEST(HandEyeCampaign, ErrsLessThanOpencvAndNeverMuchInSilence) {
  std::vector<PoseError> ours;
  std::array<std::vector<PoseError>, 5> peers;
  for (int i = 0; i < 100; ++i) {
    const CampaignCase c = run_campaign_case(i);
    ours.push_back(c.ours);
    for (std::size_t m = 0; m < peers.size(); ++m) peers[m].push_back(c.peers[m]);
    if (c.answer == Answer::trusted) {
      EXPECT_FALSE(is_garbage(c.ours)) << "case " << i << ": " << c.ours.rotation_deg << " deg, "
                                       << c.ours.translation_mm << " mm";
      EXPECT_LT(c.sigmas, 4) << "case " << i;
    } else {
      EXPECT_NE(c.words, "") << "case " << i;
    }
  }
  for (std::size_t m = 0; m < peers.size(); ++m) {
    EXPECT_LT(median_rotation_deg(ours), median_rotation_deg(peers[m])) << kOpencvHandEyeMethods[m];
    EXPECT_LT(median_translation_mm(ours), median_translation_mm(peers[m])) << kOpencvHandEyeMethods[m];
  }
}

}  // namespace
}  // namespace crumple
