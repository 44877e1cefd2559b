#include "datasets/image_io.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<unsigned char>;

cv::Mat random_image(int type, int seed) {
  cv::Mat image(48, 64, type);
  cv::RNG generator(static_cast<unsigned>(seed));
  generator.fill(image, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_8U ? 256 : 65536);
  return image;
}

Bytes encoded(const std::string& extension, const cv::Mat& image) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes));
  return bytes;
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

struct Format {
  std::string extension;
  int type;
};

class LosslessFormat : public ::testing::TestWithParam<Format> {};

TEST_P(LosslessFormat, GreyComesBackUntouched) {
  const cv::Mat image = random_image(GetParam().type, 1);
  const auto decoded = decode_image(encoded(GetParam().extension, image), "image");
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_TRUE(equal(*decoded, image));
}

TEST_P(LosslessFormat, AnyTruncationIsNoticed) {
  const Bytes whole = encoded(GetParam().extension, random_image(GetParam().type, 2));
  // TIFF puts its directory behind the pixels and pads; its last bytes carry nothing that must be there.
  for (const double share : {0.0, 0.001, 0.02, 0.3, 0.6, 0.9, 0.97}) {
    const Bytes part(whole.begin(),
                     whole.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(whole.size())));
    const auto decoded = decode_image(part, "frame_07");
    ASSERT_FALSE(decoded) << GetParam().extension << " at " << share;
    EXPECT_THAT(decoded.error().message, HasSubstr("frame_07 is"));
  }
}

INSTANTIATE_TEST_SUITE_P(All, LosslessFormat,
                         ::testing::Values(Format{".png", CV_8U}, Format{".png", CV_16U}, Format{".tiff", CV_8U},
                                           Format{".tiff", CV_16U}, Format{".bmp", CV_8U}, Format{".pgm", CV_8U},
                                           Format{".pgm", CV_16U}),
                         [](const auto& test) {
                           return test.param.extension.substr(1) + (test.param.type == CV_8U ? "8" : "16");
                         });

TEST(ImageIo, NamesTheLastByteThatIsMissing) {
  for (const std::string extension : {".png", ".jpg", ".bmp", ".pgm"}) {
    Bytes bytes = encoded(extension, random_image(CV_8U, 3));
    bytes.pop_back();
    const auto decoded = decode_image(bytes, "frame");
    ASSERT_FALSE(decoded) << extension;
    EXPECT_THAT(decoded.error().message, HasSubstr("truncated")) << extension;
  }
}

TEST(ImageIo, NoticesTruncatedJpeg) {
  const Bytes whole = encoded(".jpg", random_image(CV_8UC3, 4));
  ASSERT_TRUE(decode_image(whole, "photo"));
  for (std::size_t length = 1; length < whole.size(); length += whole.size() / 50) {
    EXPECT_FALSE(decode_image(std::span(whole).first(length), "photo")) << length;
  }
}

TEST(ImageIo, AcceptsBytesAfterTheImage) {
  for (const std::string extension : {".png", ".jpg", ".bmp", ".pgm"}) {
    Bytes bytes = encoded(extension, random_image(CV_8U, 5));
    bytes.insert(bytes.end(), 100, 0);
    EXPECT_TRUE(decode_image(bytes, "image")) << extension;
  }
}

TEST(ImageIo, NoticesDamageInsidePng) {
  Bytes bytes = encoded(".png", random_image(CV_8U, 6));
  bytes[bytes.size() / 2] ^= 0x55;
  const auto decoded = decode_image(bytes, "frame");
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message, HasSubstr("damaged"));
}

// 678 bytes made OpenCV allocate 2.7 GB, and 1128 bytes of run-length coded BMP kept it busy for seven seconds.
TEST(ImageIo, RefusesHeadersThatStateMoreThanTheirBytesHold) {
  const auto message_with = [](Bytes bytes, std::size_t at, const Bytes& size) {
    std::copy(size.begin(), size.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
    const auto decoded = decode_image(bytes, "frame");
    return decoded ? "no error" : decoded.error().message;
  };
  const Bytes jpeg = encoded(".jpg", random_image(CV_8UC3, 10));
  const Bytes frame_header = {0xFF, 0xC0};
  const auto at = std::search(jpeg.begin(), jpeg.end(), frame_header.begin(), frame_header.end()) - jpeg.begin();
  EXPECT_THAT(message_with(jpeg, static_cast<std::size_t>(at) + 5, {0x75, 0x30, 0x75, 0x30}),
              HasSubstr("more pixels than its bytes can hold"));
  Bytes bmp = encoded(".bmp", random_image(CV_8U, 11));
  bmp[30] = 1;  // run-length coded
  EXPECT_THAT(message_with(bmp, 18, {0, 0x7D, 0, 0, 0, 0x7D, 0, 0}), HasSubstr("more pixels than its bytes can hold"));
  Bytes tiff = encoded(".tiff", random_image(CV_8U, 12));
  ASSERT_EQ(tiff[0], 'I');
  const std::size_t directory = tiff[4] + 256U * tiff[5];
  for (std::size_t entry = directory + 2; entry < directory + 26; entry += 12) {  // the first two: width and height
    tiff[entry + 8] = 0;
    tiff[entry + 9] = 0x7D;
  }
  EXPECT_THAT(message_with(tiff, 0, {}), HasSubstr("more pixels than its bytes can hold"));
}

// Found by fuzzing: what OpenCV does not take for a PPM went to its DICOM decoder, which ended the program.
TEST(ImageIo, NoOtherFormatHidesBehindAKnownStart) {
  const std::string dicom = "P3x 1 1 255 1 2 3" + std::string(111, ' ') + "DICM" + std::string(3, '\1');
  EXPECT_THAT(decode_image(Bytes(dicom.begin(), dicom.end()), "frame").error().message,
              HasSubstr("is not a PNG, TIFF, BMP, PGM or JPEG"));
  const std::string grey = "P5 16 16 255\n" + std::string(115, ' ') + "DICM" + std::string(137, '\1');
  const auto decoded = decode_image(Bytes(grey.begin(), grey.end()), "frame");
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_EQ(decoded->at<unsigned char>(7, 3), 'D');
}

TEST(ImageIo, TakesBlankImagesHoweverWellTheyCompress) {
  const cv::Mat blank = cv::Mat::zeros(2048, 2048, CV_8U);
  for (const std::string extension : {".png", ".tiff", ".jpg"}) {
    EXPECT_TRUE(decode_image(encoded(extension, blank), "blank")) << extension;
  }
}

TEST(ImageIo, SurvivesNoise) {
  cv::RNG generator(7);
  for (const std::string extension : {".png", ".jpg", ".tiff", ".bmp", ".pgm"}) {
    const Bytes whole = encoded(extension, random_image(CV_8U, 8));
    for (int trial = 0; trial < 50; ++trial) {
      Bytes bytes = whole;
      for (int i = 0; i < 8; ++i) {
        const auto at =
            static_cast<std::size_t>(generator(static_cast<unsigned>(std::min<std::size_t>(bytes.size(), 200))));
        bytes[at] = static_cast<unsigned char>(generator(256U));
      }
      const auto decoded = decode_image(bytes, "noise");
      EXPECT_TRUE(!decoded || decoded->channels() == 1);
    }
  }
}

TEST(ImageIo, ColourBecomesLinearLight) {
  cv::Mat image(1, 5, CV_8UC3);
  image.at<cv::Vec3b>(0) = {255, 255, 255};
  image.at<cv::Vec3b>(1) = {0, 0, 255};  // red, in OpenCV's order
  image.at<cv::Vec3b>(2) = {0, 255, 0};
  image.at<cv::Vec3b>(3) = {255, 0, 0};
  image.at<cv::Vec3b>(4) = {188, 188, 188};
  const auto srgb = decode_image(encoded(".png", image), "image");
  ASSERT_TRUE(srgb);
  ASSERT_EQ(srgb->type(), CV_16U);
  EXPECT_EQ(srgb->at<std::uint16_t>(0), 65535);
  EXPECT_EQ(srgb->at<std::uint16_t>(1), std::lround(0.2126 * 65535));
  EXPECT_EQ(srgb->at<std::uint16_t>(2), std::lround(0.7152 * 65535));
  EXPECT_EQ(srgb->at<std::uint16_t>(3), std::lround(0.0722 * 65535));
  // sRGB 188 is close to half the light: ((188 / 255 + 0.055) / 1.055) ^ 2.4 = 0.50289.
  EXPECT_NEAR(srgb->at<std::uint16_t>(4) / 65535.0, 0.50289, 1e-5);

  const auto linear = decode_image(encoded(".png", image), "image", ColourEncoding::linear);
  ASSERT_TRUE(linear);
  EXPECT_EQ(linear->at<std::uint16_t>(4), 188 * 257);
}

TEST(ImageIo, NamesTheFileThatCannotBeRead) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_image(folder.path() / "none.png").error().message, HasSubstr("none.png does not exist"));
  EXPECT_THAT(read_image(folder.path()).error().message, HasSubstr("is not a file"));
  std::ofstream(folder.path() / "empty.png").close();
  EXPECT_THAT(read_image(folder.path() / "empty.png").error().message, HasSubstr("empty.png is empty"));
  std::ofstream(folder.path() / "text.png") << "not an image";
  EXPECT_THAT(read_image(folder.path() / "text.png").error().message,
              HasSubstr("is not a PNG, TIFF, BMP, PGM or JPEG"));
}

TEST(ImageIo, WritesWhatItReads) {
  const TemporaryFolder folder;
  const cv::Mat image = random_image(CV_16U, 9);
  ASSERT_TRUE(write_png(folder.path() / "a.png", image));
  const auto back = read_image(folder.path() / "a.png");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_TRUE(equal(*back, image));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.png.part"));
  EXPECT_FALSE(write_png(folder.path() / "no/folder/a.png", image));
  EXPECT_FALSE(write_png(folder.path() / "b.png", cv::Mat(2, 2, CV_32F)));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "b.png"));
}

}  // namespace
}  // namespace crumple
