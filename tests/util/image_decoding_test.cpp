#include "slam/util/image_decoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

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

TEST(ImageDecoding, ReadsTheSizeInEveryHeader) {
  for (const Format& format : kFormats) {
    const std::string bytes = Encoded(format, {67, 301});
    EXPECT_EQ(SizeInHeader(bytes), cv::Size(67, 301)) << format.extension;
    const DecodedImage decoded = DecodeImage(bytes, cv::IMREAD_COLOR);
    EXPECT_EQ(decoded.problem, "") << format.extension;
    EXPECT_EQ(decoded.pixels.size(), cv::Size(67, 301)) << format.extension;
  }
}

TEST(ImageDecoding, ReadsHeadersOfOtherPrograms) {
  using namespace std::string_view_literals;
  EXPECT_EQ(SizeInHeader("P5 # made by hand\n# twice\n 20 30\n255\n"), cv::Size(20, 30));
  EXPECT_EQ(SizeInHeader("MM\0*\0\0\0\x08\0\x02\x01\x01\0\x04\0\0\0\x01\0\0\x01\x2D"
                         "\x01\0\0\x03\0\0\0\x01\0\x43\0\0"sv),
            cv::Size(67, 301));
  EXPECT_EQ(SizeInHeader("BM\0\0\0\0\0\0\0\0\0\0\0\0\x28\0\0\0\x43\0\0\0\xD3\xFE\xFF\xFF"sv),
            cv::Size(67, 301));
  EXPECT_EQ(SizeInHeader("BM\0\0\0\0\0\0\0\0\0\0\0\0\x0C\0\0\0\x43\0\x2D\x01"sv), cv::Size(67, 301));
  EXPECT_EQ(SizeInHeader("RIFF\0\0\0\0WEBPVP8X\0\0\0\0\0\0\0\0\x42\0\0\x2C\x01\0"sv), cv::Size(67, 301));
}

// Each takes from 0.8 to 3 GiB if its pixels are decoded before its size is looked at.
TEST(ImageDecoding, DoesNotDecodeWhatClaimsTooManyPixels) {
  using namespace std::string_view_literals;
  const auto with = [](std::string bytes, std::size_t at, std::string_view side) {
    return bytes.replace(at, side.size(), side);
  };
  const std::string bmp = Encoded({".bmp", {}}, {64, 48});
  const std::string tiff = Encoded({".tif", {}}, {64, 48});
  const std::size_t width = tiff.find("\x00\x01\x03\x00\x01\x00\x00\x00\x40"sv);  // the tag of the width
  ASSERT_NE(width, std::string::npos);
  for (const std::string& bytes : {with(bmp, 18, "\x20\x4E\0\0"sv), with(tiff, width + 8, "\x20\x4E"sv),
                                   std::string("P6\n20000 48\n255\nabc")}) {
    const DecodedImage decoded = DecodeImage(bytes, cv::IMREAD_COLOR);
    EXPECT_THAT(decoded.problem, HasSubstr("claims 20000x48 pixels, expected at most 16384 a side"));
    EXPECT_TRUE(decoded.pixels.empty());
  }
  EXPECT_THAT(DecodeImage("P6\n16000 16000\n65535\nabc", cv::IMREAD_COLOR).problem,
              HasSubstr("claims 16000x16000 pixels, expected at most 16384 a side and 67108864 in all"));
}

TEST(ImageDecoding, RefusesOtherFormatsAndEveryBeginningOfAFile) {
  for (const Format& format : kFormats) {
    const std::string bytes = Encoded(format, {24, 20});
    for (std::size_t length = 0; length < std::min<std::size_t>(bytes.size(), 64); ++length) {
      const std::optional<cv::Size> size = SizeInHeader(std::string_view(bytes).substr(0, length));
      EXPECT_TRUE(!size || (size->width <= 24 && size->height <= 20)) << format.extension << ' ' << length;
    }
  }
  EXPECT_EQ(DecodeImage(Encoded({".hdr", {}}, {24, 20}), cv::IMREAD_COLOR).problem, "is no readable image");
  EXPECT_EQ(DecodeImage("", cv::IMREAD_COLOR).problem, "is no readable image");
}

}  // namespace
}  // namespace sqslam
