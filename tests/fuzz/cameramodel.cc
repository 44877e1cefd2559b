// .cameramodel. What is accepted is finite, and its text is accepted again.
#include "datasets/cameramodel_file.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto model = parse_cameramodel(text_of(data, size));
  if (!model) return 0;
  const Pose& pose = model->camera_from_reference;
  require(pose.rotation.coeffs().allFinite() && pose.translation.allFinite(), "poses are finite");
  const auto again = parse_cameramodel(cameramodel_text(*model));
  require(again.has_value(), "what is written can be read: " + (again ? "" : again.error().message));
  require(again->lens.parameters() == model->lens.parameters(), "lenses come back the same");
  return 0;
}
