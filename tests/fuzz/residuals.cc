// residuals.csv of a rig: the corners that are read back from it.
#include "datasets/residuals_file.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto views = parse_recorded_corners(text_of(data, size), "residuals.csv");
  if (!views) {
    require(!views.error().message.empty(), "a refusal says why");
    return 0;
  }
  for (const RecordedCorners& view : *views) {
    require(!view.corners.empty() && view.pixels.size() == view.corners.size() &&
                view.residuals_px.size() == view.corners.size() && view.accepted.size() == view.corners.size(),
            "a view has corners, and all of each");
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      require(view.pixels[i].allFinite() && view.residuals_px[i].allFinite(), "numbers are finite");
    }
  }
  return 0;
}
