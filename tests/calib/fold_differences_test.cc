#include "calib/fold_differences.h"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_lens.h"
#include "tests/calib/made_system_data.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const CalibrationOptions kFlatBoards{.warp = WarpChoice::off};

FoldDifferences folds_of(const CalibrationData& data) {
  const auto calibration = calibrate(data, kFlatBoards);
  if (!calibration) throw std::runtime_error(calibration.error().message);
  auto folds = fold_differences(data, *calibration, 1, [] {});
  if (!folds) throw std::runtime_error(folds.error().message);
  return std::move(*folds);
}

// Noise alone changes things by what is expected. Where one direction is known much less than others a ratio scatters
// by half its size, but not its probability; that of the LEDs, a dozen numbers in each of five folds, is close to one.
TEST(FoldDifferences, AreAsLargeAsExpectedFromNoiseAlone) {
  constexpr unsigned kCampaigns = 6;
  int compared = 0, unlikely = 0;
  double of_leds = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    const FoldDifferences folds =
        folds_of(data_of(make_system({.stations = 12, .tracker_placements = 8, .seed = seed})));
    EXPECT_EQ(folds.folds.size(), 10u);
    EXPECT_THAT(folds.folds[0].left_out,
                ElementsAre("placement_1", "placement_6", "station_0", "station_5", "station_10"));
    EXPECT_THAT(folds.folds[5].left_out,
                ElementsAre("placement_1", "placement_2", "station_0", "station_1", "station_2"));
    EXPECT_THAT(reasons_of(folds), IsEmpty()) << seed;
    std::vector<std::string> names;
    for (const FoldedQuantity& quantity : folds.quantities) {
      names.push_back(quantity.name);
      ++compared;
      if (quantity.probability < 0.05) ++unlikely;
      if (quantity.name == "LEDs") of_leds += quantity.ratio * quantity.ratio / kCampaigns;
    }
    EXPECT_THAT(names, ElementsAre("cam0", "proj0", "track0", "track1", "cam0 proj0", "track0 track1", "LEDs",
                                   "LEDs against cam0 proj0"));
  }
  EXPECT_LE(unlikely, compared / 8);
  EXPECT_GT(of_leds, 0.6);
  EXPECT_LT(of_leds, 1.5);
}

const std::vector<double> kTerms{700, 705, 515, 380, -0.25, 0.12, 4e-4, -3e-4, -0.03};

CalibrationData seen_by(std::vector<double> terms, double zoom, double sigma_px, const char* model) {
  for (const std::size_t focal : {0, 1}) terms[focal] *= zoom;
  return made_lens(Lens::create("LENSMODEL_OPENCV5", {1024, 768}, terms).value(), model, sigma_px, 1).data;
}

// Some views of twelve through a lens that was refocused.
CalibrationData refocused(const std::vector<std::size_t>& placements, double zoom, double sigma_px) {
  CalibrationData data = seen_by(kTerms, 1, sigma_px, "LENSMODEL_OPENCV5");
  const CalibrationData other = seen_by(kTerms, zoom, sigma_px, "LENSMODEL_OPENCV5");
  for (const std::size_t p : placements) data.observations.corners[p] = other.observations.corners[p];
  return data;
}

// By 2 %: sigma and inflation take up most of the misfit of each view, and the views' contradiction shows. So it does
// from some view on, and where all that is expected is below what counts as none.
TEST(FoldDifferences, NameTheViewsOfALensThatWasRefocused) {
  EXPECT_THAT(reasons_of(folds_of(refocused({}, 1, 0.1))), IsEmpty());
  EXPECT_THAT(reasons_of(folds_of(refocused({1, 6, 11}, 1.02, 0.1))),
              ElementsAre(HasSubstr("without p1, p6, p11 what cam0 sees")));
  EXPECT_THAT(reasons_of(folds_of(refocused({10, 11}, 1.03, 0.1))),
              ElementsAre(HasSubstr("without p10, p11 what cam0 sees")));
}

TEST(FoldDifferences, OfAPreciseCalibrationAreComparedToo) {
  const FoldDifferences folds = folds_of(refocused({}, 1, 1e-4));
  EXPECT_THAT(reasons_of(folds), IsEmpty());
  ASSERT_EQ(folds.quantities.size(), 1u);
  EXPECT_LT(folds.quantities[0].rms, 1e-3);
  EXPECT_GT(folds.quantities[0].ratio, 0.2);
  EXPECT_LT(folds.quantities[0].ratio, 4);
}

// A model that blurs all views alike: sigma and inflation take it up whole, and no view contradicts the others.
TEST(FoldDifferences, SayNothingOfWhatAllViewsHaveInCommon) {
  const FoldDifferences blurred = folds_of(seen_by(kTerms, 1, 0.1, "LENSMODEL_PINHOLE"));
  EXPECT_THAT(reasons_of(blurred), IsEmpty());
  EXPECT_GT(blurred.quantities.at(0).rms, 1);
  EXPECT_LT(blurred.quantities.at(0).ratio, 2);
}

// An LED that is seen at the stations of one fold alone.
TEST(FoldDifferences, LeaveOutNothingThatIsNotSeenElsewhere) {
  CalibrationData data = data_of(make_system({.stations = 12, .tracker_placements = 8}));
  for (LedView& view : data.observations.leds) {
    if (!view.station || *view.station % 5 == 0 || view.leds.empty() || view.leds[0] != 0) continue;
    view.leds.erase(view.leds.begin());
    view.pixels.erase(view.pixels.begin());
  }
  const FoldDifferences folds = folds_of(data);
  EXPECT_THAT(folds.folds[0].not_done, HasSubstr("nothing is left that tells"));
  EXPECT_THAT(folds.folds[1].not_done, IsEmpty());
  EXPECT_THAT(sentences_of(folds),
              ElementsAre(HasSubstr("without placement_1, placement_6, station_0, station_5 and 1 more")));
}

TEST(FoldDifferences, WantThreeOfAKind) {
  const Lens lens = Lens::create("LENSMODEL_PINHOLE", {1024, 768}, {700, 705, 515, 380}).value();
  CalibrationData data = made_lens(lens, "LENSMODEL_PINHOLE", 0.1, 1).data;
  const auto calibration = calibrate(data, kFlatBoards);
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_EQ(fold_steps(data.observations, *calibration), 11u);
  std::erase_if(data.observations.corners, [](const CornerView& view) { return view.placement > 1; });
  EXPECT_EQ(fold_steps(data.observations, *calibration), 0u);
  const auto refused = fold_differences(data, *calibration, 1, [] {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("three stations"));
}

}  // namespace
}  // namespace crumple
