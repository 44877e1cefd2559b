#include "datasets/image_io.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/image_completeness.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

// IEC 61966-2-1: the light of an sRGB value, both from 0 to 1.
double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

template <typename Value>
cv::Mat grey_from_colour(const cv::Mat& image, ColourEncoding colour) {
  constexpr int kLevels = sizeof(Value) == 1 ? 256 : 65536;
  constexpr std::array<double, 3> kWeights = {0.0722, 0.7152, 0.2126};  // Rec. 709, in OpenCV's order: blue first
  std::array<std::vector<double>, 3> light;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    light[channel].resize(kLevels);
    for (int level = 0; level < kLevels; ++level) {
      const double value = level / (kLevels - 1.0);
      light[channel][level] =
          65535 * kWeights[channel] * (colour == ColourEncoding::srgb ? linear_from_srgb(value) : value);
    }
  }
  const int channels = image.channels();
  cv::Mat grey(image.size(), CV_16U);
  for (int y = 0; y < image.rows; ++y) {
    const Value* in = image.ptr<Value>(y);
    auto* out = grey.ptr<std::uint16_t>(y);
    for (int x = 0; x < image.cols; ++x, in += channels) {
      out[x] = static_cast<std::uint16_t>(std::lround(light[0][in[0]] + light[1][in[1]] + light[2][in[2]]));
    }
  }
  return grey;
}

Expected<cv::Mat> single_channel(const cv::Mat& image, const std::string& name, ColourEncoding colour) {
  if (image.depth() != CV_8U && image.depth() != CV_16U) {
    return fail(fmt::format("{} holds neither 8 nor 16 bit values: convert it to 16 bit PNG or TIFF", name));
  }
  if (image.channels() == 1) return image;
  if (image.channels() == 2) {
    cv::Mat grey;
    cv::extractChannel(image, grey, 0);
    return grey;
  }
  if (image.channels() > 4) return fail(fmt::format("{} has {} channels: keep one or three", name, image.channels()));
  return image.depth() == CV_8U ? grey_from_colour<std::uint8_t>(image, colour)
                                : grey_from_colour<std::uint16_t>(image, colour);
}

}  // namespace

Expected<cv::Mat> decode_image(std::span<const unsigned char> bytes, const std::string& name, ColourEncoding colour) {
  if (bytes.size() > std::numeric_limits<int>::max()) return fail(fmt::format("{} is larger than 2 GB", name));
  if (const auto lack = what_image_lacks(bytes)) return fail(fmt::format("{} {}", name, *lack));
  try {
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8U, const_cast<unsigned char*>(bytes.data()));
    const cv::Mat image = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
    if (image.empty()) return fail(fmt::format("{} is damaged: its pixels cannot be decoded", name));
    return single_channel(image, name, colour);
  } catch (const std::exception& exception) {
    return fail(fmt::format("{} cannot be decoded: {}", name, exception.what()));
  }
}

Expected<cv::Mat> read_image(const std::filesystem::path& file, ColourEncoding colour) {
  const auto content = read_file(file);
  if (!content) return tl::unexpected(content.error());
  const auto* bytes = reinterpret_cast<const unsigned char*>(content->data());
  return decode_image({bytes, content->size()}, file.string(), colour);
}

Expected<std::filesystem::path> write_png(const std::filesystem::path& file, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  try {
    const bool known = image.type() == CV_8UC1 || image.type() == CV_16UC1 || image.type() == CV_8UC3;
    if (image.empty() || !known || !cv::imencode(".png", image, bytes)) {
      return fail(fmt::format("{} cannot be written: only grey images of 8 or 16 bit and colour images of 8 bit can",
                              file.string()));
    }
  } catch (const std::exception& exception) {
    return fail(fmt::format("{} cannot be encoded: {}", file.string(), exception.what()));
  }
  const auto written = write_file(file, std::string(bytes.begin(), bytes.end()));
  if (!written) return tl::unexpected(written.error());
  return file;
}

}  // namespace crumple
