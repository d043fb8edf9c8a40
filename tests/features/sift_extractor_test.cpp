#include "slam/features/sift_extractor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "slam/features/matching.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::TexturedWorld;

const Camera& WorldCamera() {
  static const Camera camera = TexturedWorld().GetCamera();
  return camera;
}

// A wall, and the same wall as it looks from `tilt` (rad) aside and `nearer` times as near.
struct TwoViews {
  cv::Mat first;
  cv::Mat second;
  cv::Matx33d H;  // from the first view to the second
};

TwoViews SeeWall(double tilt, double nearer) {
  const Camera& camera = WorldCamera();
  TwoViews views;
  views.first = TexturedWorld().Render(0, {}).bgr;
  const cv::Matx33d K(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const cv::Matx33d turn(std::cos(tilt), 0, 0, 0, 1, 0, -std::sin(tilt), 0, 1.0 / nearer);
  views.H = K * turn * K.inv();
  cv::warpPerspective(views.first, views.second, cv::Mat(views.H), views.first.size(), cv::INTER_AREA);
  return views;
}

// Counts the matches that lie where the second view shows the same place.
int CorrectMatches(const FrameFeatures& a, const FrameFeatures& b, const cv::Matx33d& H) {
  constexpr double kMaxError = 3.0;  // px
  int correct = 0;
  for (const auto& [i, j] : MatchAll(a, b, {}, {}, 64, 0.85)) {
    const cv::Vec3d p = H * cv::Vec3d(a.keypoints[i].pixel.x(), a.keypoints[i].pixel.y(), 1.0);
    const Eigen::Vector2d expected(p[0] / p[2], p[1] / p[2]);
    correct += (expected - b.keypoints[j].pixel).norm() <= kMaxError ? 1 : 0;
  }
  return correct;
}

FrameFeatures Sift(const cv::Mat& bgr, int num_features, const cv::Mat& ignored = {}) {
  return SiftExtractor({num_features}).Extract(bgr, WorldCamera(), ScaleLevels({}), ignored);
}

FrameFeatures Orb(const cv::Mat& bgr, int num_features) {
  cv::Mat gray;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  return OrbExtractor({.num_features = num_features}).Extract(gray, bgr, WorldCamera());
}

TEST(SiftExtractor, FindsMoreInViewsFarApartThanOrb) {
  constexpr int kFeatures = 800;
  const TwoViews views = SeeWall(0.8, 1.0);
  const int sift = CorrectMatches(Sift(views.first, kFeatures), Sift(views.second, kFeatures), views.H);
  const int orb = CorrectMatches(Orb(views.first, kFeatures), Orb(views.second, kFeatures), views.H);
  EXPECT_GT(sift, 30);
  EXPECT_GT(sift, 2 * orb);
}

TEST(SiftExtractor, FindsSamePlacesInNearerView) {
  const TwoViews views = SeeWall(0.0, 2.0);
  EXPECT_GT(CorrectMatches(Sift(views.first, 800), Sift(views.second, 800), views.H), 60);
}

TEST(SiftExtractor, KeepsLargestKeypointsAndGivesOctaveBySize) {
  const cv::Mat bgr = TexturedWorld().Render(0, {}).bgr;
  const FrameFeatures all = Sift(bgr, 10000);
  const FrameFeatures few = Sift(bgr, 100);
  ASSERT_EQ(few.Size(), 100U);
  ASSERT_GT(all.Size(), 300U);
  EXPECT_EQ(few.kind, FeatureKind::kSift);
  EXPECT_GT(std::ranges::min(few.keypoints, {}, &Keypoint::octave).octave, 2);
  EXPECT_EQ(std::ranges::min(all.keypoints, {}, &Keypoint::octave).octave, 0);
  EXPECT_EQ(few.descriptors.size(), few.Size());
  EXPECT_EQ(few.colors.size(), few.Size());
}

TEST(SiftExtractor, SkipsIgnoredRegionOfCoarserMask) {
  const cv::Mat bgr = TexturedWorld().Render(0, {}).bgr;
  cv::Mat ignored = cv::Mat::zeros(bgr.rows / 4, bgr.cols / 4, CV_8UC1);
  ignored(cv::Rect(0, 0, ignored.cols / 2, ignored.rows)).setTo(255);
  const FrameFeatures features = Sift(bgr, 500, ignored);
  EXPECT_GT(features.Size(), 200U);
  EXPECT_TRUE(std::ranges::all_of(features.keypoints, [&](const Keypoint& keypoint) {
    return keypoint.raw_pixel.x() > bgr.cols / 2 - 2.0;
  }));
}

TEST(SiftExtractor, FindsNothingInUniformImage) {
  EXPECT_EQ(Sift(cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(90)), 500).Size(), 0U);
}

}  // namespace
}  // namespace sqslam
