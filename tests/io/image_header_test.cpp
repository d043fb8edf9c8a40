#include "slam/io/image_header.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/util/text_lines.h"
#include "tests/io/photograph.h"

namespace sqslam {
namespace {

const cv::Mat kPixels(30, 40, CV_8UC3, cv::Scalar::all(99));

TEST(ImageHeader, AgreesWithDecoderOnEveryOrientation) {
  const TemporaryFolder folder;
  for (std::uint32_t orientation = 0; orientation <= 9; ++orientation) {
    const auto file = WritePhotograph(folder, "a.jpg", kPixels, {.orientation = orientation});
    const auto header = ReadImageHeader(file);
    ASSERT_TRUE(header) << orientation;
    EXPECT_EQ(header->size, cv::imread(file.string()).size()) << orientation;
    EXPECT_EQ(JpegHeader(ReadFile(file, "a photograph")), header) << orientation;
  }
}

TEST(ImageHeader, NeedsNoPixels) {
  const TemporaryFolder folder;
  const std::string bytes =
      ReadFile(WritePhotograph(folder, "a.jpg", kPixels, {.orientation = 6}), "a photograph");
  const std::size_t pixels = bytes.find("\xFF\xDA");
  const auto header = ReadImageHeader(folder.Write("b.jpg", bytes.substr(0, pixels)));
  ASSERT_TRUE(header);
  EXPECT_EQ(header->size, cv::Size(30, 40));
  EXPECT_EQ(header->quarter_turns, 1);
  for (const std::size_t length : {0, 1, 2, 3, 5, 20, 100}) {
    EXPECT_FALSE(ReadImageHeader(folder.Write("c.jpg", bytes.substr(0, length)))) << length;
  }
  EXPECT_FALSE(ReadImageHeader(folder.Path()));
  EXPECT_FALSE(ReadImageHeader(folder.Path() / "none.jpg"));
}

TEST(ImageHeader, ReadsOtherFormats) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.bmp", "a.ppm", "a.tif", "a.webp"}) {
    const std::filesystem::path file = folder.Path() / name;
    cv::imwrite(file.string(), kPixels);
    const auto header = ReadImageHeader(file);
    ASSERT_TRUE(header) << name;
    EXPECT_EQ(header->size, cv::Size(40, 30)) << name;
  }
}

TEST(QuarterTurns, BringBackPixelsOfTheSensor) {
  const cv::Size landscape(40, 30), portrait(30, 40);
  EXPECT_EQ(QuarterTurnsTo(landscape, {landscape, 0}), 0);
  EXPECT_EQ(QuarterTurnsTo(portrait, {portrait, 1}), 0);
  EXPECT_EQ(QuarterTurnsTo(landscape, {portrait, 1}), 3);
  EXPECT_EQ(QuarterTurnsTo(landscape, {portrait, 3}), 1);
  EXPECT_EQ(QuarterTurnsTo(portrait, {landscape, 2}), 3);
  // Without EXIF, as if the camera had been turned as in {portrait, 1}.
  EXPECT_EQ(QuarterTurnsTo(landscape, {portrait, 0}), 3);
  EXPECT_EQ(QuarterTurnsTo(portrait, {landscape, 0}), 1);
  EXPECT_EQ(QuarterTurnsTo({30, 30}, {portrait, 1}), 0);
  EXPECT_EQ(QuarterTurnsTo(landscape, {{30, 30}, 1}), 0);
}

TEST(QuarterTurns, TurnBoxesWithPixels) {
  const Box2d box{4.0, 6.0, 10.0, 8.0};
  cv::Mat image(30, 40, CV_8UC1, cv::Scalar(0));
  image(cv::Rect(4, 6, 10, 8)).setTo(255);
  for (int turns = -4; turns <= 4; ++turns) {
    const cv::Mat turned = Turned(image, turns);
    EXPECT_EQ(turned.size(), Turned(image.size(), turns));
    const cv::Rect pixels = cv::boundingRect(turned);
    const Box2d moved = Turned(box, image.size(), turns, {2 * turned.cols, 2 * turned.rows});
    EXPECT_EQ(moved.x, 2.0 * pixels.x) << turns;
    EXPECT_EQ(moved.y, 2.0 * pixels.y) << turns;
    EXPECT_EQ(moved.width, 2.0 * pixels.width) << turns;
    EXPECT_EQ(moved.height, 2.0 * pixels.height) << turns;
  }
}

}  // namespace
}  // namespace sqslam
