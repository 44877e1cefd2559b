#include "datasets/image_completeness.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

namespace crumple {
namespace {

using Bytes = std::span<const unsigned char>;

constexpr const char* kTruncated = "is truncated: copy it again from the camera's own storage";
constexpr const char* kOverstated = "states more pixels than its bytes can hold: it is damaged";

bool starts_with(Bytes bytes, Bytes magic) {
  return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
}

std::uint64_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | bytes[at + i];
  return value;
}

std::uint64_t little_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = count; i > 0; --i) value = value << 8 | bytes[at + i - 1];
  return value;
}

// What a file's own header says of it.
struct Scan {
  bool whole = false;
  std::uint64_t pixels = 0;  // that decoding allocates; 0 where wholeness bounds them
};

// Blank images compress best, DEFLATE's by 1032 and LZW's by some 1400, with up to 8 pixels in a byte. A damaged header
// is not to make a decoder allocate gigabytes.
bool is_overstated(const Scan& scan, std::size_t bytes) {
  constexpr std::uint64_t kFree = 1U << 20;
  constexpr std::uint64_t kMostPixelsPerByte = 1U << 14;
  return scan.pixels > kFree + kMostPixelsPerByte * bytes;
}

bool png_is_whole(Bytes bytes) {
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const std::uint64_t length = big_endian(bytes, at, 4);
    if (length > bytes.size() - at - 12) return false;
    if (big_endian(bytes, at + 4, 4) == 0x49454E44) return true;  // IEND
    at += 12 + static_cast<std::size_t>(length);
  }
  return false;
}

Scan scan_png(Bytes bytes) {
  if (!png_is_whole(bytes) || bytes.size() < 24) return {};
  return {true, big_endian(bytes, 16, 4) * big_endian(bytes, 20, 4)};
}

// Whether a JPEG marker starts a frame header, which states the size.
bool is_frame_header(unsigned char marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// Segments up to the end-of-image marker; inside the scans, FF 00 and the restart markers belong to the data.
Scan scan_jpeg(Bytes bytes) {
  Scan scan;
  std::size_t at = 2;
  bool in_scan = false;
  while (at + 1 < bytes.size()) {
    if (bytes[at] != 0xFF) {
      if (!in_scan) return {};
      ++at;
      continue;
    }
    const unsigned char marker = bytes[at + 1];
    if (marker == 0xD9) {
      scan.whole = true;
      return scan;
    }
    if (marker == 0xFF) {
      ++at;
    } else if (marker == 0x00 || marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      at += 2;
    } else {
      if (at + 4 > bytes.size()) return {};
      if (is_frame_header(marker) && at + 9 <= bytes.size())
        scan.pixels = std::max(scan.pixels, big_endian(bytes, at + 5, 2) * big_endian(bytes, at + 7, 2));
      at += 2 + static_cast<std::size_t>(big_endian(bytes, at + 2, 2));
      in_scan = marker == 0xDA;
    }
  }
  return {};
}

Scan scan_bmp(Bytes bytes) {
  if (bytes.size() < 54) return {};
  const std::uint64_t data_offset = little_endian(bytes, 10, 4);
  const std::uint64_t width = little_endian(bytes, 18, 4);
  const auto height = static_cast<std::int32_t>(little_endian(bytes, 22, 4));
  const std::uint64_t rows = static_cast<std::uint64_t>(std::abs(static_cast<std::int64_t>(height)));
  const std::uint64_t bits_per_pixel = little_endian(bytes, 28, 2);
  const std::uint64_t compression = little_endian(bytes, 30, 4);
  // Files of OS/2's short header and run-length coded ones state their size in the file header only.
  const bool whole = little_endian(bytes, 2, 4) <= bytes.size();
  if (little_endian(bytes, 14, 4) < 40) return {whole, little_endian(bytes, 18, 2) * little_endian(bytes, 20, 2)};
  if (compression == 1 || compression == 2) return {whole, width * rows};
  constexpr std::uint64_t kMostPixels = 1U << 24;  // along a side; keeps the product below within 64 bits
  if (width > kMostPixels || rows > kMostPixels || bits_per_pixel > 64) return {};
  const std::uint64_t row_bytes = (width * bits_per_pixel + 31) / 32 * 4;
  return {data_offset + row_bytes * rows <= bytes.size(), width * rows};
}

// A cursor over a netpbm header or its ASCII pixels: numbers between white space and comments.
class PnmScanner {
 public:
  explicit PnmScanner(Bytes bytes) : bytes_(bytes) {}

  std::optional<std::uint64_t> number() {
    while (at_ < bytes_.size() && std::isdigit(bytes_[at_]) == 0) {
      if (bytes_[at_] == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      } else {
        ++at_;
      }
    }
    if (at_ == bytes_.size()) return {};
    std::uint64_t value = 0;
    for (; at_ < bytes_.size() && std::isdigit(bytes_[at_]) != 0; ++at_) {
      value = std::min<std::uint64_t>(value * 10 + (bytes_[at_] - '0'), 1U << 30);
    }
    return value;
  }
  std::size_t position() const { return at_; }

 private:
  Bytes bytes_;
  std::size_t at_ = 2;
};

bool pnm_is_whole(Bytes bytes) {
  const char kind = static_cast<char>(bytes[1]);
  const std::uint64_t channels = kind == '3' || kind == '6' ? 3 : 1;
  PnmScanner scanner(bytes);
  const auto width = scanner.number();
  const auto height = scanner.number();
  const auto largest = scanner.number();
  if (!width || !height || !largest) return false;
  const std::uint64_t samples = *width * *height * channels;
  if (kind == '5' || kind == '6') {
    return scanner.position() + 1 + samples * (*largest > 255 ? 2 : 1) <= bytes.size();
  }
  for (std::uint64_t i = 0; i < samples; ++i) {
    if (!scanner.number()) return false;
  }
  return true;
}

// The first directory of a classic TIFF; its strips or tiles must lie within the file.
class TiffReader {
 public:
  explicit TiffReader(Bytes bytes) : bytes_(bytes), little_(bytes[0] == 'I') {}

  Scan scan() const {
    if (bytes_.size() < 8) return {};
    const std::uint64_t directory = read(4, 4);
    if (directory + 2 > bytes_.size()) return {};
    const std::uint64_t entries = read(directory, 2);
    if (directory + 2 + 12 * entries + 4 > bytes_.size()) return {};
    std::optional<std::uint64_t> offsets;
    std::optional<std::uint64_t> lengths;
    std::uint64_t width = 0, height = 0, tile_width = 0, tile_height = 0;
    for (std::uint64_t i = 0; i < entries; ++i) {
      const std::uint64_t entry = directory + 2 + 12 * i;
      const std::uint64_t tag = read(entry, 2);
      if (tag == 273 || tag == 324) offsets = entry;
      if (tag == 279 || tag == 325) lengths = entry;
      if (tag == 256) width = std::max(width, value(entry, 0).value_or(0));
      if (tag == 257) height = std::max(height, value(entry, 0).value_or(0));
      if (tag == 322) tile_width = std::max(tile_width, value(entry, 0).value_or(0));
      if (tag == 323) tile_height = std::max(tile_height, value(entry, 0).value_or(0));
    }
    return {offsets && lengths && strips_are_whole(*offsets, *lengths),
            std::max(width * height, tile_width * tile_height)};
  }

 private:
  std::uint64_t read(std::uint64_t at, std::size_t count) const {
    const auto position = static_cast<std::size_t>(at);
    return little_ ? little_endian(bytes_, position, count) : big_endian(bytes_, position, count);
  }

  // Value `index` of a directory entry of SHORTs or LONGs; small arrays are stored in the entry itself.
  std::optional<std::uint64_t> value(std::uint64_t entry, std::uint64_t index) const {
    const std::size_t size = read(entry + 2, 2) == 3 ? 2 : 4;
    const std::uint64_t count = read(entry + 4, 4);
    const std::uint64_t start = count * size <= 4 ? entry + 8 : read(entry + 8, 4);
    const std::uint64_t at = start + index * size;
    if (index >= count || at + size > bytes_.size()) return {};
    return read(at, size);
  }

  bool strips_are_whole(std::uint64_t offsets, std::uint64_t lengths) const {
    const std::uint64_t count = read(offsets + 4, 4);
    if (count == 0 || count > bytes_.size()) return false;
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto offset = value(offsets, i);
      const auto length = value(lengths, i);
      if (!offset || !length || *offset + *length > bytes_.size()) return false;
    }
    return true;
  }

  Bytes bytes_;
  bool little_;
};

// Without the white space OpenCV would take the file for none of its own and try decoders that nobody asked for, such
// as GDCM's, which aborts on what is no DICOM file.
bool is_pnm(Bytes bytes) {
  return bytes.size() >= 3 && bytes[0] == 'P' &&
         (bytes[1] == '2' || bytes[1] == '3' || bytes[1] == '5' || bytes[1] == '6') && std::isspace(bytes[2]) != 0;
}

}  // namespace

std::optional<std::string> what_image_lacks(Bytes bytes) {
  constexpr std::array<unsigned char, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::array<unsigned char, 3> kJpeg = {0xFF, 0xD8, 0xFF};
  constexpr std::array<unsigned char, 2> kBmp = {'B', 'M'};
  constexpr std::array<unsigned char, 4> kTiffLittle = {'I', 'I', 42, 0};
  constexpr std::array<unsigned char, 4> kTiffBig = {'M', 'M', 0, 42};
  Scan scan;
  if (bytes.empty()) return "is empty";
  if (starts_with(bytes, kPng)) {
    scan = scan_png(bytes);
  } else if (starts_with(bytes, kJpeg)) {
    scan = scan_jpeg(bytes);
  } else if (starts_with(bytes, kBmp)) {
    scan = scan_bmp(bytes);
  } else if (starts_with(bytes, kTiffLittle) || starts_with(bytes, kTiffBig)) {
    scan = TiffReader(bytes).scan();
  } else if (is_pnm(bytes)) {
    scan.whole = pnm_is_whole(bytes);
  } else {
    return "is not a PNG, TIFF, BMP, PGM or JPEG image: convert it to PNG without loss";
  }
  if (!scan.whole) return kTruncated;
  return is_overstated(scan, bytes.size()) ? std::optional<std::string>(kOverstated) : std::nullopt;
}

}  // namespace crumple
