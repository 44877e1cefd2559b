#include "calib/unseen_parts.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/verdict.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr ImageSize kUnseenSize{1024, 768};

// An observation in every cell but those of some columns and rows, with a sigma of 0.1 px there and 0.5 px elsewhere.
struct MadeImage {
  ImageCells cells = image_cells({}, kUnseenSize);
  SensorUncertainty uncertainty{800, {}};

  explicit MadeImage(int unseen_columns, int unseen_rows) {
    for (int cell = 0; cell < static_cast<int>(cells.cells.size()); ++cell) {
      const bool seen = cell % cells.columns >= unseen_columns || cell / cells.columns >= unseen_rows;
      cells.cells[static_cast<std::size_t>(cell)].observations = seen ? 1 : 0;
      uncertainty.sigma_px.emplace_back(seen ? 0.1 : 0.5);
    }
  }
};

Rig cameras(std::size_t count) {
  Rig rig;
  for (std::size_t s = 0; s < count; ++s) {
    rig.sensors.push_back({"cam" + std::to_string(s),
                           SensorKind::camera,
                           Lens::undistorted("LENSMODEL_PINHOLE", kUnseenSize, 1000, 1000, {511.5, 383.5}).value(),
                           {}});
  }
  return rig;
}

TEST(UnseenParts, AreNamedWithWhatIsKnownThere) {
  const MadeImage corner(6, 4), full(0, 0);
  const auto parts = unseen_parts(cameras(2), {full.cells, corner.cells}, {full.uncertainty, corner.uncertainty});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].sensor, 1U);
  EXPECT_EQ(parts[0].name, "upper left");
  EXPECT_NEAR(parts[0].sigma_px, 0.5, 1e-12);
  EXPECT_NEAR(parts[0].seen_sigma_px, 0.1, 1e-12);
}

TEST(UnseenParts, OneObservationIsEnough) {
  MadeImage corner(6, 4);
  corner.cells.cells[0].observations = 1;
  EXPECT_THAT(unseen_parts(cameras(1), {corner.cells}, {corner.uncertainty}), IsEmpty());
}

// Where the lens has no rays no board can mend it.
TEST(UnseenParts, PixelsWithoutRaysDoNotMatter) {
  MadeImage corner(6, 4);
  for (int cell = 0; cell < 3 * corner.cells.columns; ++cell)
    corner.uncertainty.sigma_px[static_cast<std::size_t>(cell)].reset();
  const auto parts = unseen_parts(cameras(1), {corner.cells}, {corner.uncertainty});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_NEAR(parts[0].sigma_px, 0.5, 1e-12);
  EXPECT_NEAR(parts[0].seen_sigma_px, 0.1, 1e-12);
  for (std::optional<double>& sigma_px : corner.uncertainty.sigma_px) sigma_px.reset();
  EXPECT_THAT(unseen_parts(cameras(1), {corner.cells}, {corner.uncertainty}), IsEmpty());
  EXPECT_THAT(unseen_parts(cameras(1), {corner.cells}, {std::nullopt}), IsEmpty());
}

// The camera sees the part of the panel that is right of its middle.
TEST(UnseenParts, OfAProjectorThoseThatACameraSeesCount) {
  const MadeImage full(0, 0), nothing(16, 12);
  Rig rig = cameras(2);
  rig.sensors[1].kind = SensorKind::projector;
  rig.sensors[1].sensor_from_mount.translation.x() = 409.6;

  const auto parts = unseen_parts(rig, {full.cells, nothing.cells}, {full.uncertainty, nothing.uncertainty});
  std::vector<std::string> names;
  for (const UnseenPart& part : parts) names.push_back(part.name);
  EXPECT_THAT(names, ElementsAre("top", "upper right", "middle", "right", "bottom", "lower right"));
}

// From observations to the sentence.
TEST(Verdict, SaysWhereNoBoardWas) {
  CalibrationData data = data_of(
      make_synthetic({.placements = 8, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.1, .feature_sigma_px = 0.1}));
  data.observations.features.clear();
  const auto said = [&] {
    const auto calibration = calibrate(data, {.warp = WarpChoice::off});
    EXPECT_TRUE(calibration) << calibration.error().message;
    const Verdict verdict = judge(data, *calibration, 1);
    std::vector<std::string> all = verdict.reasons;
    all.insert(all.end(), verdict.notes.begin(), verdict.notes.end());
    return all;
  };
  EXPECT_THAT(said(), Not(Contains(AllOf(HasSubstr("no view covers"), HasSubstr("of cam0")))));
  for (CornerView& view : data.observations.corners) {
    CornerView kept{view.sensor, view.placement, {}, {}};
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      if (view.pixels[i].x() < 600 || view.pixels[i].y() > 400) continue;
      kept.corners.push_back(view.corners[i]);
      kept.pixels.push_back(view.pixels[i]);
    }
    view = kept;
  }
  EXPECT_THAT(said(), Contains(AllOf(HasSubstr("no view covers"), HasSubstr("the lower left,"), HasSubstr("of cam0"))));
}

}  // namespace
}  // namespace crumple
