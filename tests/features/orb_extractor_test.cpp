#include "slam/features/orb_extractor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <set>

#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::TexturedWorld;

FrameFeatures ExtractFirstImage(const OrbOptions& options = {}) {
  const TexturedWorld world;
  const Frame frame = world.Render(0, {});
  return OrbExtractor(options).Extract(frame.gray, frame.bgr, world.GetCamera());
}

TEST(OrbExtractor, SpreadsFeaturesOverImageAndScales) {
  const FrameFeatures features = ExtractFirstImage();
  EXPECT_GE(features.Size(), 700U);
  EXPECT_LE(features.Size(), 1200U);
  std::array<int, 16> per_cell{};
  std::array<int, 8> per_octave{};
  for (const Keypoint& keypoint : features.keypoints) {
    ++per_cell[static_cast<std::size_t>(keypoint.pixel.x() / 80.0) +
               4 * static_cast<std::size_t>(keypoint.pixel.y() / 60.0)];
    ++per_octave[static_cast<std::size_t>(keypoint.octave)];
  }
  EXPECT_GE(*std::min_element(per_cell.begin(), per_cell.end()), 15);
  EXPECT_GE(per_octave[0], per_octave[4]);
  EXPECT_GE(per_octave[4], 10);
}

TEST(OrbExtractor, SkipsIgnoredRegionAndSpreadsOverRest) {
  const TexturedWorld world;
  const Frame frame = world.Render(0, {});
  cv::Mat ignored = cv::Mat::zeros(frame.gray.size(), CV_8UC1);
  ignored(cv::Rect(0, 0, ignored.cols / 2, ignored.rows)).setTo(255);
  const FrameFeatures features = OrbExtractor({}).Extract(frame.gray, frame.bgr, world.GetCamera(), ignored);
  EXPECT_TRUE(std::ranges::all_of(features.keypoints, [&](const Keypoint& keypoint) {
    return keypoint.raw_pixel.x() > ignored.cols / 2 - 2.0;
  }));
  EXPECT_GT(features.Size(), 6 * ExtractFirstImage().Size() / 10);
}

TEST(OrbExtractor, AcceptsMoreLevelsThanFitTheImage) {
  const FrameFeatures features = ExtractFirstImage({.scale_factor = 2.0, .levels = 12});
  EXPECT_GE(features.Size(), 300U);
}

TEST(OrbExtractor, RepeatsItself) {
  const FrameFeatures first = ExtractFirstImage();
  const FrameFeatures second = ExtractFirstImage();
  ASSERT_EQ(first.Size(), second.Size());
  EXPECT_EQ(first.descriptors, second.descriptors);
}

TEST(OrbExtractor, FindsNothingInUniformImage) {
  const cv::Mat gray(240, 320, CV_8UC1, cv::Scalar(128));
  const cv::Mat bgr(240, 320, CV_8UC3, cv::Scalar::all(128));
  const FrameFeatures features = OrbExtractor({}).Extract(gray, bgr, TexturedWorld().GetCamera());
  EXPECT_EQ(features.Size(), 0U);
}

// A level's pixels must be carried to the full image about the right centre: any shift would show twice.
TEST(OrbExtractor, FindsSamePlacesInMirroredImage) {
  const TexturedWorld world;
  const Frame frame = world.Render(0, {});
  cv::Mat gray;
  cv::Mat bgr;
  cv::flip(frame.gray, gray, -1);  // both axes
  cv::flip(frame.bgr, bgr, -1);
  const FrameFeatures features = ExtractFirstImage();
  const FrameFeatures mirrored = OrbExtractor({}).Extract(gray, bgr, world.GetCamera());
  const ScaleLevels levels{OrbOptions{}};
  for (int octave = 0; octave < 6; ++octave) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int pairs = 0;
    for (const Keypoint& keypoint : features.keypoints) {
      const Eigen::Vector2d image(gray.cols - 1.0 - keypoint.pixel.x(), gray.rows - 1.0 - keypoint.pixel.y());
      for (const Keypoint& other : mirrored.keypoints) {
        if (keypoint.octave == octave && other.octave == octave &&
            (other.pixel - image).norm() < 2.0 * levels.Scale(octave)) {
          sum += other.pixel - image;
          ++pairs;
        }
      }
    }
    ASSERT_GE(pairs, 20) << octave;
    EXPECT_LT((sum / pairs).norm(), 0.12 * levels.Scale(octave)) << octave;
  }
}

TEST(OrbExtractor, UndistortsKeypointsAndKeepsRawPixel) {
  const TexturedWorld world;
  Camera camera = world.GetCamera();
  camera.distortion = {0.1, -0.05, 0.0, 0.0, 0.0};
  const Frame frame = world.Render(0, {});
  const FrameFeatures features = OrbExtractor({}).Extract(frame.gray, frame.bgr, camera);
  for (const Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2d raw = camera.ProjectDistorted(camera.Unproject(keypoint.pixel));
    EXPECT_LT((raw - keypoint.raw_pixel).norm(), 1e-4);
  }
}

// The lens model folds over: near the image's corners no ray has the pixel, and what undistorting it gives is
// beyond what a saved map holds.
TEST(OrbExtractor, SkipsKeypointsThatUndistortOutOfReach) {
  const Camera camera{1920, 1080, 900.0, 900.0, 960.0, 540.0, {-0.5, 3.0, 0.0, 0.0, -15.0}};
  constexpr int kSide = 11;
  cv::Mat gray(camera.height, camera.width, CV_8UC1, cv::Scalar(90));
  for (const int x : {24, 955, 1885}) {
    for (const int y : {24, 535, 1045}) {
      gray(cv::Rect(x, y, kSide, kSide)).setTo(230);
    }
  }
  cv::GaussianBlur(gray, gray, {5, 5}, 1.0);  // else neighbours are equally good corners
  cv::Mat bgr;
  cv::cvtColor(gray, bgr, cv::COLOR_GRAY2BGR);
  const FrameFeatures all = OrbExtractor({}).Extract(gray, bgr, camera.WithoutDistortion());
  const auto beyond = std::ranges::count_if(all.keypoints, [&](const Keypoint& keypoint) {
    return !IsInReach(camera.Undistort(keypoint.raw_pixel));
  });
  ASSERT_GT(beyond, 0);
  const FrameFeatures features = OrbExtractor({}).Extract(gray, bgr, camera);
  EXPECT_EQ(features.Size() + static_cast<std::size_t>(beyond), all.Size());
  EXPECT_GT(features.Size(), 0U);
  for (const Keypoint& keypoint : features.keypoints) {
    EXPECT_TRUE(IsInReach(keypoint.pixel)) << keypoint.pixel.transpose();
  }
}

TEST(KeypointGrid, VisitsAllKeypointsWithinTheRadius) {
  const FrameFeatures features = ExtractFirstImage();
  for (const Eigen::Vector2d pixel : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(160.0, 120.0),
                                      Eigen::Vector2d(319.0, 10.0), Eigen::Vector2d(-20.0, 260.0)}) {
    constexpr double kRadius = 25.0;
    std::set<int> visited;
    features.grid.ForEachNear(pixel, kRadius, [&](int i) { visited.insert(i); });
    for (std::size_t i = 0; i < features.Size(); ++i) {
      if ((features.keypoints[i].pixel - pixel).norm() <= kRadius) {
        EXPECT_TRUE(visited.contains(static_cast<int>(i)));
      }
    }
    EXPECT_LT(visited.size(), features.Size() / 2);
  }
}

TEST(ScaleLevels, PredictsOctaveByDistance) {
  const ScaleLevels levels{OrbOptions{}};
  EXPECT_EQ(levels.PredictOctave(10.0, 10.0), 0);
  EXPECT_EQ(levels.PredictOctave(10.0 / levels.Scale(3) * 1.001, 10.0), 3);
  EXPECT_EQ(levels.PredictOctave(0.001, 10.0), levels.Count() - 1);
}

}  // namespace
}  // namespace sqslam
