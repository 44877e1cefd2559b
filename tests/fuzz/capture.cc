// capture.yaml. Of a capture that is accepted, every image has a name of its own below the image folder.
#include "datasets/capture.h"

#include <algorithm>
#include <set>

#include "tests/fuzz/input.h"

namespace {

constexpr std::size_t most_images = 2000;

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto capture = parse_capture(text_of(data, size), "capture.yaml");
  if (!capture) {
    require(!capture.error().message.empty(), "a refusal says why");
    return 0;
  }
  std::set<std::string> seen;
  for (const auto& [camera, naming] : capture->files) {
    for (const Station& station : capture->stations) {
      const std::size_t frames = capture->took_images(camera, station) ? capture->frames_of(camera).size() : 0;
      for (std::size_t frame = 0; frame < frames && seen.size() < most_images; ++frame) {
        const auto file = capture->image_file(camera, station.id, frame);
        const auto below = file.lexically_normal().lexically_relative(capture->images.lexically_normal());
        require(!below.empty() && *below.begin() != "..", "images lie below their folder: " + file.string());
        require(seen.insert(file.string()).second, "no two images have the same name: " + file.string());
      }
    }
  }
  return 0;
}
