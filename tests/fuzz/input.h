// What fuzz targets share. A target is one .cc in this folder; it takes any bytes, and what it finds wrong beyond what
// the sanitizers see, it says through `require`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace crumple {

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// Ends the run, so that the input is kept as a failure.
inline void require(bool condition, const std::string& sentence) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", sentence.c_str());
  std::abort();
}

}  // namespace crumple
