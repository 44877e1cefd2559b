// Python's literals. What is accepted is a value that JSON can hold.
#include "datasets/python_literal.h"

#include "datasets/json_text.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto value = parse_python_literal(text_of(data, size));
  if (!value) return 0;
  const auto text = json_text(*value);
  require(text.has_value(), "numbers are finite");
  return 0;
}
