#include "datasets/led_images.h"

#include <filesystem>

#include <fmt/format.h>

#include "tracking/spots.h"

namespace crumple {

Expected<BlinkCode> blink_code_of(const Capture& capture) {
  if (capture.leds.empty()) return fail(fmt::format("{} describes no LEDs", capture.description.string()));
  std::vector<std::uint32_t> words;
  for (const CaptureLed& led : capture.leds) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < led.word.size(); ++k) word |= (led.word[k] == '1' ? 1u : 0u) << k;
    words.push_back(word);
  }
  auto code = BlinkCode::create(static_cast<int>(capture.leds.front().word.size()), std::move(words));
  if (!code) return fail(fmt::format("{}: leds: {}", capture.description.string(), code.error().message));
  return code;
}

std::map<std::string, Eigen::Vector3d> nominal_places_mm(const Capture& capture) {
  std::map<std::string, Eigen::Vector3d> places;
  for (const CaptureLed& led : capture.leds) {
    if (led.mount == Mount::probe && led.nominal_mm) places[led.name] = *led.nominal_mm;
  }
  return places;
}

Expected<Identification> read_lights(const Capture& capture, const BlinkCode& code, const std::string& camera,
                                     const std::string& station, const IdentifyOptions& options) {
  std::vector<std::optional<std::vector<Spot>>> frames;
  const std::vector<FrameContent>& contents = capture.frames_of(camera);
  for (std::size_t f = 0; f < contents.size(); ++f) {
    if (contents[f].kind != FrameContent::Kind::leds) continue;
    if (!std::filesystem::exists(capture.image_file(camera, station, f))) {
      frames.emplace_back();
      continue;
    }
    const auto image = read_frame(capture, camera, station, f);
    if (!image) return tl::unexpected(image.error());
    auto found = find_spots(*image);
    if (!found) return fail(fmt::format("station {}, {}: {}", station, camera, found.error().message));
    frames.emplace_back(std::move(found->spots));
  }
  auto lights = identify_leds(code, frames, options);
  if (!lights) return fail(fmt::format("station {}, {}: {}", station, camera, lights.error().message));
  return lights;
}

}  // namespace crumple
