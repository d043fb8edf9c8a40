#include "slam/util/image_decoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "slam/util/limits.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

struct Format {
  std::string extension;
  std::vector<int> parameters;
};

std::string Encoded(const Format& format, const cv::Size& size) {
  cv::Mat image(size, CV_8UC3);
  cv::randu(image, 0, 255);
  std::vector<unsigned char> bytes;
  cv::imencode(format.extension, image, bytes, format.parameters);
  return {bytes.begin(), bytes.end()};
}

const std::vector<Format> kFormats = {{".png", {}},
                                      {".jpg", {}},
                                      {".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
                                      {".bmp", {}},
                                      {".ppm", {}},
                                      {".ppm", {cv::IMWRITE_PXM_BINARY, 0}},
                                      {".tif", {}},
                                      {".webp", {cv::IMWRITE_WEBP_QUALITY, 80}},
                                      {".webp", {cv::IMWRITE_WEBP_QUALITY, 101}}};  // lossless

TEST(ImageDecoding, DecodesEveryFormat) {
  for (const Format& format : kFormats) {
    const DecodedImage decoded = DecodeImage(Encoded(format, {67, 301}), cv::IMREAD_COLOR);
    EXPECT_EQ(decoded.problem, "") << format.extension;
    EXPECT_EQ(decoded.pixels.size(), cv::Size(67, 301)) << format.extension;
  }
}

// Returns the image with another width and height, 2 or 4 bytes each, written over those in its header.
std::string WithSides(std::string bytes, std::size_t at, std::string_view sides) {
  return bytes.replace(at, sides.size(), sides);
}

TEST(ImageDecoding, RefusesTooManyPixelsWithoutTakingMemory) {
  using namespace std::string_view_literals;
  const std::string jpeg = Encoded({".jpg", {}}, {64, 48});
  const std::string progressive = Encoded({".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1}}, {64, 48});
  const std::string bmp = Encoded({".bmp", {}}, {64, 48});
  const std::string tiff = Encoded({".tif", {}}, {64, 48});
  const std::size_t width = tiff.find("\x00\x01\x03\x00\x01\x00\x00\x00\x40"sv);  // the tag of the width
  ASSERT_NE(width, std::string::npos);
  const std::vector<std::string> claims = {
      WithSides(jpeg, jpeg.find("\xFF\xC0"sv) + 5, "\x75\x30\x75\x30"sv),                // 30000 x 30000
      WithSides(progressive, progressive.find("\xFF\xC2"sv) + 5, "\x75\x30\x75\x30"sv),  // the same
      WithSides(jpeg, jpeg.find("\xFF\xC0"sv) + 5, "\xFD\xE8\xFD\xE8"sv),  // 65000 x 65000: OpenCV refuses it
      WithSides(bmp, 18, "\x20\x4E\0\0"sv),                                // 20000 x 48
      WithSides(tiff, width + 8, "\x20\x4E"sv),                            // 20000 x 48
      "P6\n20000 48\n255\nabc",
      "P6\n16000 16000\n65535\nabc"};
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const DecodedImage decoded = DecodeImage(claims[i], cv::IMREAD_COLOR);
    EXPECT_TRUE(decoded.too_large) << i;
    EXPECT_THAT(decoded.problem,
                HasSubstr("is too large, expected at most 16384 pixels a side and 67108864 in all"))
        << i;
    EXPECT_TRUE(decoded.pixels.empty()) << i;
  }
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  EXPECT_LT(usage.ru_maxrss, 500'000) << "kB";
}

TEST(ImageDecoding, DoesNotLimitOtherMatrices) { EXPECT_NO_THROW(cv::Mat(1, kMaxImageSide + 1, CV_8UC1)); }

TEST(ImageDecoding, RefusesOtherFormatsAndCutOffHeaders) {
  for (const Format& format : kFormats) {
    const std::string bytes = Encoded(format, {24, 20});
    for (std::size_t length = 0; length < std::min<std::size_t>(bytes.size(), 20); ++length) {
      EXPECT_EQ(DecodeImage(std::string_view(bytes).substr(0, length), cv::IMREAD_COLOR).problem,
                "cannot be decoded")
          << format.extension << ' ' << length;
    }
  }
  EXPECT_EQ(DecodeImage(Encoded({".hdr", {}}, {24, 20}), cv::IMREAD_COLOR).problem, "cannot be decoded");
}

}  // namespace
}  // namespace sqslam
