// mrcal's .cameramodel files, one per camera.
#include "tests/fuzz/rig_format.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return crumple::read_in_format("mrcal", data, size);
}
