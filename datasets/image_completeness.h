// Whether an image file is whole. Decoders fill what a truncated file lacks with grey and at most print a warning, so
// the end is looked for in the bytes themselves: PNG's IEND chunk, JPEG's end-of-image marker, the extent of a BMP's,
// PGM's or TIFF's pixel data. A header that states more pixels than the file's bytes can hold is found here too.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace crumple {

// No value where the file is whole; else what it is or lacks, as the end of a sentence that starts with its name.
std::optional<std::string> what_image_lacks(std::span<const unsigned char> bytes);

}  // namespace crumple
