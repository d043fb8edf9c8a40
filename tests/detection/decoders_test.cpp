#include "slam/detection/decoders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "slam/util/error.h"

namespace sqslam {
namespace {

constexpr int kClasses = 3;

cv::Mat Zeros(std::vector<int> sizes) {
  return {static_cast<int>(sizes.size()), sizes.data(), CV_32F, cv::Scalar(0)};
}

TEST(DecodeYoloxTest, ReadsCellStrideSizeAndProductOfScores) {
  const cv::Size input(64, 32);  // 8x4, 4x2 and 2x1 cells
  cv::Mat output = Zeros({1, 32 + 8 + 2, 5 + kClasses});
  float* cell = output.ptr<float>() + (32 + 4 + 2) * (5 + kClasses);  // stride 16, column 2 of row 1
  const float values[] = {0.5F, 0.25F, std::log(2.0F), std::log(0.5F), 0.8F, 0.1F, 0.9F, 0.2F};
  std::copy(std::begin(values), std::end(values), cell);
  const auto boxes = DecodeYolox(output, input, kClasses, 0.3);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].class_number, 1);
  EXPECT_NEAR(boxes[0].score, 0.72, 1e-6);
  EXPECT_NEAR(boxes[0].box.Center().x(), 2.5 * 16, 1e-4);
  EXPECT_NEAR(boxes[0].box.Center().y(), 1.25 * 16, 1e-4);
  EXPECT_NEAR(boxes[0].box.width, 32.0, 1e-4);
  EXPECT_NEAR(boxes[0].box.height, 8.0, 1e-4);
  EXPECT_TRUE(DecodeYolox(output, input, kClasses, 0.75).empty());
}

TEST(DecodeCenterNetTest, TakesPeaksWithTheirSidesStrongestFirst) {
  const cv::Size input(64, 32);
  cv::Mat heat = Zeros({1, kClasses, 8, 16});
  cv::Mat sides = Zeros({1, 4, 8, 16});
  const auto at = [](cv::Mat& blob, int plane, int y, int x) -> float& {
    return blob.ptr<float>()[(plane * 8 + y) * 16 + x];
  };
  at(heat, 2, 3, 5) = 0.6F;
  at(heat, 2, 3, 6) = 0.5F;  // beside the peak
  at(heat, 0, 7, 15) = 0.9F;
  for (int s = 0; s < 4; ++s) {
    at(sides, s, 3, 5) = static_cast<float>(2 + s);
  }
  const auto boxes = DecodeCenterNet(heat, sides, input, kClasses, 0.3, 10);
  ASSERT_EQ(boxes.size(), 2U);
  EXPECT_EQ(boxes[0].class_number, 0);
  EXPECT_EQ(boxes[1].class_number, 2);
  EXPECT_NEAR(boxes[1].box.x, 20.0 - 2.0, 1e-5);
  EXPECT_NEAR(boxes[1].box.y, 12.0 - 3.0, 1e-5);
  EXPECT_NEAR(boxes[1].box.width, 2.0 + 4.0, 1e-5);
  EXPECT_NEAR(boxes[1].box.height, 3.0 + 5.0, 1e-5);
  EXPECT_EQ(DecodeCenterNet(heat, sides, input, kClasses, 0.3, 1).size(), 1U);
}

TEST(DecodeYoloV8Test, ReadsColumns) {
  cv::Mat output = Zeros({1, 4 + kClasses, 5});
  const float values[] = {30.0F, 20.0F, 10.0F, 6.0F, 0.1F, 0.2F, 0.7F};
  for (int row = 0; row < 7; ++row) {
    output.ptr<float>()[row * 5 + 3] = values[row];
  }
  const auto boxes = DecodeYoloV8(output, kClasses, 0.5);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].class_number, 2);
  EXPECT_NEAR(boxes[0].box.x, 25.0, 1e-5);
  EXPECT_NEAR(boxes[0].box.y, 17.0, 1e-5);
}

TEST(DecodersTest, RefusesOtherShapesNamingBoth) {
  try {
    DecodeYolox(Zeros({1, 42, 85}), {64, 32}, kClasses, 0.3);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("1x42x85"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("1x42x8 "), std::string::npos) << e.what();
  }
  EXPECT_THROW(DecodeCenterNet(Zeros({1, 3, 8, 16}), Zeros({1, 2, 8, 16}), {64, 32}, 3, 0.3, 9), InputError);
  EXPECT_THROW(DecodeYoloV8(Zeros({1, 9, 5}), kClasses, 0.5), InputError);
}

TEST(SuppressionTest, DropsWeakerBoxOfSameClassOnly) {
  const Box2d a{0, 0, 10, 10};
  const Box2d b{1, 0, 10, 10};
  const auto kept = SuppressNonMaxima({{a, 0, 0.5}, {b, 0, 0.9}, {a, 1, 0.4}, {{30, 0, 5, 5}, 0, 0.3}}, 0.5);
  ASSERT_EQ(kept.size(), 3U);
  EXPECT_EQ(kept[0].score, 0.9);
  EXPECT_EQ(kept[1].class_number, 1);
  EXPECT_EQ(kept[2].score, 0.3);
}

TEST(LetterboxTest, KeepsAspectRatioAndMapsBack) {
  const Letterbox letterbox({1280, 720}, {640, 480});
  const cv::Mat filled = letterbox.Fill(cv::Mat(720, 1280, CV_8UC3, cv::Scalar(10, 20, 30)));
  ASSERT_EQ(filled.size(), cv::Size(640, 480));
  EXPECT_EQ(filled.at<cv::Vec3b>(359, 639), cv::Vec3b(10, 20, 30));
  EXPECT_EQ(filled.at<cv::Vec3b>(361, 0), cv::Vec3b(114, 114, 114));
  const Box2d box = letterbox.ToImage({100, 50, 200, 400});
  EXPECT_NEAR(box.x, 200.0, 1e-9);
  EXPECT_NEAR(box.height, 720.0 - 100.0, 1e-9);  // cut off at the bottom of the image
}

}  // namespace
}  // namespace sqslam
