#include "slam/tracking/feature_stage.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/objects/test_camera.h"

namespace sqslam {
namespace {

constexpr int kFrames = 6;
const Box2d kPerson{40.0, 30.0, 120.0, 150.0};

// A person stands in every frame but the first; its box is given in every second one.
Frame FrameAt(int index) {
  Frame frame;
  frame.index = index;
  frame.timestamp = 0.1 * index;
  frame.gray.create(480, 640, CV_8UC1);
  cv::RNG(static_cast<std::uint64_t>(index) + 1).fill(frame.gray, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(frame.gray, frame.gray, {}, 1.5);
  cv::normalize(frame.gray, frame.gray, 0, 255, cv::NORM_MINMAX);
  cv::cvtColor(frame.gray, frame.bgr, cv::COLOR_GRAY2BGR);
  if (index % 2 == 1) {
    frame.detections = {{"person", 0.9, kPerson}};
  }
  return frame;
}

class FeatureStageTest : public ::testing::Test {
 protected:
  StageTimes times_;
  FeatureStage direct_{testing::TestCamera(), {}, {{"person"}}, times_};
  FeatureStage ahead_{testing::TestCamera(), {}, {{"person"}}, times_};
};

void ExpectEqual(const ExtractedFeatures& a, const ExtractedFeatures& b) {
  ASSERT_EQ(a.features->Size(), b.features->Size());
  EXPECT_GT(a.features->Size(), 50U);
  for (std::size_t i = 0; i < a.features->Size(); ++i) {
    EXPECT_EQ(a.features->keypoints[i].raw_pixel, b.features->keypoints[i].raw_pixel);
    EXPECT_EQ(a.features->descriptors[i], b.features->descriptors[i]);
  }
  ASSERT_EQ(a.ignored.size(), b.ignored.size());
  EXPECT_TRUE(a.ignored.empty() || cv::countNonZero(a.ignored != b.ignored) == 0);
}

TEST_F(FeatureStageTest, GivesSameFeaturesAheadOfTime) {
  for (int i = 0; i < kFrames; ++i) {
    ahead_.Expect(FrameAt(i));
  }
  for (int i = 0; i < kFrames; ++i) {
    SCOPED_TRACE(i);
    const ExtractedFeatures expected = ahead_.Take(FrameAt(i));
    ExpectEqual(direct_.Take(FrameAt(i)), expected);
    EXPECT_EQ(expected.ignored.empty(), i == 0);  // boxes of later frames do not count
  }
}

TEST_F(FeatureStageTest, ExtractsFramesThatWereNotExpected) {
  ExpectEqual(direct_.Take(FrameAt(0)), ahead_.Take(FrameAt(0)));
  ahead_.Expect(FrameAt(1));
  ExpectEqual(direct_.Take(FrameAt(1)), ahead_.Take(FrameAt(1)));
}

TEST_F(FeatureStageTest, EndsWithFramesThatAreNeverTaken) {
  for (int i = 0; i < kFrames; ++i) {
    ahead_.Expect(FrameAt(i));
  }
}

}  // namespace
}  // namespace sqslam
