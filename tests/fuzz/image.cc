// PNG, TIFF, BMP, PGM, PPM and JPEG through our reader. What is accepted is grey, of 8 or 16 bit.
#include "datasets/image_io.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto image = decode_image({data, size}, "image");
  if (!image) return 0;
  require(!image->empty() && (image->type() == CV_8UC1 || image->type() == CV_16UC1), "images are grey");
  return 0;
}
