#include "datasets/station_pose.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/led_images.h"

namespace crumple {
namespace {

// A reference in the room that the rig is without: it says nothing of the probe.
constexpr auto kNotInRig = static_cast<std::size_t>(-1);

// The rig's index of each of the capture's LEDs.
Expected<std::vector<std::size_t>> rig_leds(const Capture& capture, const Rig& rig) {
  std::vector<std::size_t> indices;
  for (const CaptureLed& led : capture.leds) {
    const auto found = std::find_if(rig.leds.begin(), rig.leds.end(), [&](const Led& l) { return l.name == led.name; });
    if (found == rig.leds.end() && led.mount == Mount::world) {
      indices.push_back(kNotInRig);
      continue;
    }
    if (found == rig.leds.end()) {
      return fail(
          fmt::format("the rig has no LED {}: is it another probe's? If it was calibrated without that LED, leave it "
                      "out of capture.yaml too",
                      led.name));
    }
    if (found->mount != led.mount) {
      return fail(
          fmt::format("LED {} is on the probe for one of capture and rig and in the room for the other", led.name));
    }
    indices.push_back(static_cast<std::size_t>(found - rig.leds.begin()));
  }
  return indices;
}

// Without lights of LEDs that the rig does not have.
Identification of_the_rig(Identification lights, const std::vector<std::size_t>& leds) {
  const auto is_not = [&](const IdentifiedLight& light) { return leds[light.led] == kNotInRig; };
  std::erase_if(lights.leds, is_not);
  std::erase_if(lights.candidates, is_not);
  return lights;
}

// What is not averaged out over frames is as large as the rig's own residuals say.
IdentifyOptions options_for(const Rig& rig, const std::string& tracker) {
  IdentifyOptions options;
  const auto known = rig.sigma_px.find(tracker + ".leds");
  if (known != rig.sigma_px.end()) options.lasting_sigma_px = std::max(options.lasting_sigma_px, known->second);
  return options;
}

}  // namespace

bool is_tracked(const Capture& capture, const Rig& rig) {
  const bool any_led =
      std::any_of(rig.leds.begin(), rig.leds.end(), [](const Led& led) { return led.mount == Mount::probe; });
  return any_led && !capture.leds.empty() && !capture.tracker_frames.empty();
}

Expected<StationPose> station_pose(const Capture& capture, const Rig& rig, const std::string& station,
                                   PoseMethod method, const std::optional<NearPose>& near) {
  const auto code = blink_code_of(capture);
  if (!code) return tl::unexpected(code.error());
  const auto leds = rig_leds(capture, rig);
  if (!leds) return tl::unexpected(leds.error());
  const Station& where = *capture.station(station);
  std::vector<TrackerLights> trackers;
  for (const CaptureSensor& sensor : capture.sensors) {
    const auto index = rig.find(sensor.name);
    if (sensor.mount != Mount::world || !index || !capture.took_images(sensor.name, where)) continue;
    if (capture.exclusion(station, sensor.name) || !capture.find_frame(FrameContent::Kind::leds, sensor.name)) continue;
    auto lights = read_lights(capture, *code, sensor.name, station, options_for(rig, sensor.name));
    if (!lights) return tl::unexpected(lights.error());
    trackers.push_back({*index, of_the_rig(std::move(*lights), *leds)});
  }
  if (trackers.empty()) return fail(fmt::format("station {}: no tracker of the rig took images there", station));
  auto settled = method == PoseMethod::pixels
                     ? settle_constellation(rig, trackers, *leds, {.near = near})
                     : settle_by_markers(rig, trackers, *leds,
                                         method == PoseMethod::markers ? &Light::centre_of_gravity_px : &Light::pixel);
  if (!settled) return fail(fmt::format("station {}: {}", station, settled.error().message));
  Stillness still = stillness(readings_over_time(trackers, *leds));
  if (!still.still) return fail(fmt::format("station {}: {}", station, moved_text(still)));
  return StationPose{std::move(*settled), std::move(still)};
}

}  // namespace crumple
