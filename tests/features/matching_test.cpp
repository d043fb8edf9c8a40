#include "slam/features/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bitset>
#include <opencv2/imgproc.hpp>
#include <random>

#include "slam/features/orb_extractor.h"
#include "slam/geometry/lie.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::TexturedWorld;

TEST(HammingDistance, CountsDifferingBits) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 50; ++trial) {
    Descriptor a;
    Descriptor b;
    std::size_t expected = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = static_cast<std::uint8_t>(random());
      b[i] = static_cast<std::uint8_t>(random());
      expected += std::bitset<8>(a[i] ^ b[i]).count();
    }
    EXPECT_EQ(HammingDistance(a, b), static_cast<int>(expected));
  }
}

class MatchingTest : public ::testing::Test {
 protected:
  MatchingTest() {
    const Frame frame = world_.Render(0, {});
    first_ = Extract(frame.gray);
    // The same image, turned by 20 degrees and moved.
    turn_ = cv::getRotationMatrix2D({160.0F, 120.0F}, 20.0, 1.0);
    turn_.at<double>(0, 2) += 7.0;
    cv::Mat turned;
    cv::warpAffine(frame.gray, turned, turn_, frame.gray.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
    second_ = Extract(turned);
  }

  FrameFeatures Extract(const cv::Mat& gray) {
    cv::Mat bgr;
    cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
    return OrbExtractor({}).Extract(gray, bgr, world_.GetCamera());
  }

  double TransferError(int i, int j) const {
    const Eigen::Vector2d& p = first_.keypoints[static_cast<std::size_t>(i)].pixel;
    const auto& m = turn_;
    const Eigen::Vector2d moved(m.at<double>(0, 0) * p.x() + m.at<double>(0, 1) * p.y() + m.at<double>(0, 2),
                                m.at<double>(1, 0) * p.x() + m.at<double>(1, 1) * p.y() + m.at<double>(1, 2));
    return (moved - second_.keypoints[static_cast<std::size_t>(j)].pixel).norm();
  }

  TexturedWorld world_;
  FrameFeatures first_;
  FrameFeatures second_;
  cv::Mat turn_;
};

TEST_F(MatchingTest, MatchAllFindsRotatedImage) {
  const auto matches = MatchAll(first_, second_, {}, {}, kMaxUnguidedDistance, 0.8);
  ASSERT_GE(matches.size(), 100U);
  int right = 0;
  for (const auto& [i, j] : matches) {
    right += TransferError(i, j) < 4.0 ? 1 : 0;
  }
  EXPECT_GE(right, 0.95 * static_cast<double>(matches.size()));
}

// Every descriptor occurs twice, 100 px apart across the lines, so that nothing else tells which is right.
TEST(MatchAlongEpipolarLines, TellsLookAlikesApart) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0.0, 100.0);
  FrameFeatures a;
  FrameFeatures b;
  const Eigen::Vector2d motion(7.0, 20.0);
  for (int i = 0; i < 100; ++i) {
    Descriptor descriptor;
    std::ranges::generate(descriptor, [&] { return static_cast<std::uint8_t>(random()); });
    const Eigen::Vector2d p(6.0 * uniform(random), uniform(random));
    for (const double y : {0.0, 100.0}) {
      a.keypoints.push_back({.pixel = p + Eigen::Vector2d(0.0, y)});
      b.keypoints.push_back({.pixel = p + Eigen::Vector2d(0.0, y) + motion});
      a.descriptors.push_back(descriptor);
      b.descriptors.push_back(descriptor);
      b.descriptors.back()[random() % 32] ^= 15;  // as near to either of the two
    }
  }
  Eigen::Matrix3d moved = Eigen::Matrix3d::Identity();
  moved.topRightCorner<2, 1>() = motion;
  const Eigen::Matrix3d F = Skew(Eigen::Vector3d::UnitX()) * moved;  // all lines are horizontal
  EXPECT_TRUE(MatchAll(a, b, {}, {}, kMaxUnguidedDistance, 0.8).empty());
  const auto matches = MatchAlongEpipolarLines(a, b, F, 3.0, kMaxUnguidedDistance, 0.8);
  EXPECT_EQ(matches.size(), a.Size());
  for (const auto& [i, j] : matches) {
    EXPECT_EQ(i, j);
  }
  EXPECT_TRUE(
      MatchAlongEpipolarLines(a, b, Skew(Eigen::Vector3d::UnitX()), 3.0, kMaxUnguidedDistance, 0.8).empty());
}

TEST_F(MatchingTest, MatchAllRespectsMask) {
  std::vector<bool> use(first_.Size(), false);
  use[5] = use[17] = true;
  for (const auto& [i, j] : MatchAll(first_, second_, use, {}, 256, 1.0)) {
    EXPECT_TRUE(i == 5 || i == 17);
  }
}

TEST_F(MatchingTest, MatchPredictionsUsesEachKeypointOnceAndRespectsTakenOnes) {
  std::vector<PredictedPoint> predictions;
  for (std::size_t i = 0; i < first_.Size(); ++i) {
    predictions.push_back({static_cast<int>(i), first_.keypoints[i].pixel, 5.0, first_.keypoints[i].octave,
                           &first_.descriptors[i], -1.0F});
  }
  std::vector<bool> taken(first_.Size(), false);
  taken[3] = true;
  const auto matches = MatchPredictions(predictions, first_, taken, 0, 1.0);
  std::vector<bool> used(first_.Size(), false);
  for (const auto& [tag, keypoint] : matches) {
    EXPECT_NE(keypoint, 3);
    EXPECT_FALSE(used[static_cast<std::size_t>(keypoint)]);
    used[static_cast<std::size_t>(keypoint)] = true;
    EXPECT_EQ(first_.descriptors[static_cast<std::size_t>(tag)],
              first_.descriptors[static_cast<std::size_t>(keypoint)]);
  }
  EXPECT_GE(matches.size(), first_.Size() * 9 / 10);
}

TEST(ConsistentRotations, DropsPairsOffDominantRotation) {
  std::vector<std::pair<float, float>> angles(40, {50.0F, 20.0F});
  angles.emplace_back(200.0F, 20.0F);
  const std::vector<int> kept = ConsistentRotations(angles);
  EXPECT_EQ(kept.size(), 40U);
}

}  // namespace
}  // namespace sqslam
