// .npy matrices.
#include "datasets/npy_file.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto matrix = parse_npy(text_of(data, size));
  if (!matrix) return 0;
  require(matrix->allFinite(), "numbers are finite");
  require(static_cast<std::size_t>(matrix->size()) * sizeof(double) < size, "no number comes from nowhere");
  return 0;
}
