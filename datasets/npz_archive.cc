#include "datasets/npz_archive.h"

#include <array>
#include <bit>
#include <cassert>
#include <cstring>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include "datasets/npy_file.h"

namespace crumple {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

std::string little_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xFFU);
  return text;
}

template <typename Number>
std::string raw(const std::vector<Number>& values) {
  std::string data(values.size() * sizeof(Number), '\0');
  if (!data.empty()) std::memcpy(data.data(), values.data(), data.size());
  return data;
}

[[maybe_unused]] std::size_t product(const std::vector<std::size_t>& shape) {
  std::size_t count = 1;
  for (const std::size_t n : shape) count *= n;
  return count;
}

// What the local header and the central directory of a ZIP archive say alike of a stored file: version, flags, method,
// time and date (1 January 1980, so that equal contents give equal bytes), CRC, sizes, length of the name, no extra.
std::string zip_description(const std::string& name, const std::string& content) {
  const auto size = static_cast<std::uint32_t>(content.size());
  const auto checksum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
  return little_endian(20, 2) + little_endian(0, 2) + little_endian(0, 2) + little_endian(0, 2) + little_endian(33, 2) +
         little_endian(checksum, 4) + little_endian(size, 4) + little_endian(size, 4) +
         little_endian(static_cast<std::uint32_t>(name.size()), 2) + little_endian(0, 2);
}

}  // namespace

void NpzArchive::add_array(const std::string& name, const std::string& type, const std::vector<std::size_t>& shape,
                           const std::string& data) {
  const std::string comma = shape.size() == 1 ? "," : "";
  entries_.push_back({name + ".npy", npy_preamble(type, fmt::format("({}{})", fmt::join(shape, ", "), comma)) + data});
}

void NpzArchive::add(const std::string& name, const std::vector<std::size_t>& shape,
                     const std::vector<double>& values) {
  assert(values.size() == product(shape));
  add_array(name, "<f8", shape, raw(values));
}

void NpzArchive::add(const std::string& name, const std::vector<std::size_t>& shape,
                     const std::vector<std::int32_t>& values) {
  assert(values.size() == product(shape));
  add_array(name, "<i4", shape, raw(values));
}

void NpzArchive::add_flag(const std::string& name, bool value) {
  add_array(name, "|b1", {}, std::string(1, value ? '\1' : '\0'));
}

// UTF-32; NumPy has no texts without length, an empty one is a zero character.
void NpzArchive::add_text(const std::string& name, const std::string& ascii) {
  const std::string text = ascii.empty() ? std::string(1, '\0') : ascii;
  std::string data;
  for (const char c : text) data += little_endian(static_cast<unsigned char>(c), 4);
  add_array(name, fmt::format("<U{}", text.size()), {}, data);
}

std::string NpzArchive::bytes() const {
  std::string files, directory;
  for (const Entry& entry : entries_) {
    const std::string description = zip_description(entry.name, entry.content);
    directory += "PK\x01\x02" + little_endian(20, 2) + description + std::string(10, '\0') +
                 little_endian(static_cast<std::uint32_t>(files.size()), 4) + entry.name;
    files += "PK\x03\x04" + description + entry.name + entry.content;
  }
  const auto count = static_cast<std::uint32_t>(entries_.size());
  return files + directory + "PK\x05\x06" + std::string(4, '\0') + little_endian(count, 2) + little_endian(count, 2) +
         little_endian(static_cast<std::uint32_t>(directory.size()), 4) +
         little_endian(static_cast<std::uint32_t>(files.size()), 4) + little_endian(0, 2);
}

std::string base85(const std::string& bytes) {
  static const char* const alphabet =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t value = 0;
    for (std::size_t k = i; k < i + 4; ++k) {
      value = value << 8U | (k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0U);
    }
    std::array<char, 5> digits{};
    for (int d = 4; d >= 0; --d, value /= 85) digits[static_cast<std::size_t>(d)] = alphabet[value % 85];
    text.append(digits.data(), digits.size());
  }
  const std::size_t padding = (4 - bytes.size() % 4) % 4;
  text.resize(text.size() - padding);
  return text;
}

}  // namespace crumple
