#include "calib/led_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "solvers/pose.h"

namespace crumple {
namespace {

using testing::HasSubstr;

struct Layout {
  Rig rig;
  std::map<std::string, Eigen::Vector3d> nominal_mm;
};

// Five LEDs in another frame than the drawing's, each half a millimetre off.
Layout made_layout() {
  const std::vector<Eigen::Vector3d> drawing{{0, 0, 0}, {200, 10, 0}, {190, 150, 30}, {-20, 140, -20}, {90, 70, 80}};
  const Pose probe_from_drawing{rotation_from_vector({0.3, -0.8, 0.2}), {40, -300, 120}};
  Layout layout;
  for (std::size_t l = 0; l < drawing.size(); ++l) {
    const std::string name(1, static_cast<char>('a' + l));
    layout.nominal_mm[name] = drawing[l];
    layout.rig.leds.push_back({name, probe_from_drawing * drawing[l] + Eigen::Vector3d(0.3, l % 2 ? -0.3 : 0.3, 0)});
  }
  return layout;
}

TEST(LedLayout, NothingIsSaidWhereLedsAreInTheirPlaces) {
  const Layout layout = made_layout();
  EXPECT_TRUE(check_led_layout(layout.rig, layout.nominal_mm).empty());
}

TEST(LedLayout, SwappedWordsAreNamed) {
  Layout layout = made_layout();
  std::swap(layout.rig.leds[1].position_mm, layout.rig.leds[3].position_mm);
  const auto said = check_led_layout(layout.rig, layout.nominal_mm);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_THAT(said[0], HasSubstr("LEDs b and d seem swapped"));
}

TEST(LedLayout, AnotherProbeIsNoSwap) {
  Layout layout = made_layout();
  for (Led& led : layout.rig.leds) led.position_mm = led.position_mm.cwiseAbs2() / 100;
  const auto said = check_led_layout(layout.rig, layout.nominal_mm);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_THAT(said[0], HasSubstr("from their nominal places"));
}

}  // namespace
}  // namespace crumple
