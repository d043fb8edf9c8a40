#include "slam/run/auto_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::HandHeldPath;
using testing::TexturedWorld;
using testing::ThroughLens;
using testing::WrittenSequence;

using ::testing::AllOf;
using ::testing::HasSubstr;

AutoCamera Guess() {
  AutoCamera camera;
  camera.guess = camera.camera = {640, 480, 554.3, 554.3, 319.5, 239.5};
  camera.guessed_by = "a field of view of 60 degrees";
  camera.guess_deviation = camera.deviation = 0.3;
  return camera;
}

LearntCamera Learnt(double focal, double deviation) {
  return {{640, 480, focal, focal, 319.5, 239.5, {-0.05}}, focal, deviation, true};
}

TEST(AutoCamera, StatesIntervalOfLearntFocalLength) {
  AutoCamera camera = Guess();
  camera.Adopt(Learnt(500.0, 0.01));
  EXPECT_FALSE(camera.IsVague());
  EXPECT_THAT(camera.Text(), AllOf(HasSubstr("focal length 500.0 px"), HasSubstr("95 %: 490.3 to 509.9 px"),
                                   HasSubstr("k1 -0.050"), HasSubstr("60 degrees was 554.3 px")));
}

TEST(AutoCamera, WarnsWhenImagesDetermineFocalLengthPoorly) {
  AutoCamera camera = Guess();
  camera.Adopt(Learnt(500.0, 0.05));
  EXPECT_TRUE(camera.IsVague());
  EXPECT_THAT(camera.Text(), AllOf(HasSubstr("95 %: 453.3 to 551.5 px"), HasSubstr("determine it poorly")));
}

TEST(AutoCamera, StatesIntervalOfCommonCamerasForGuess) {
  const AutoCamera camera = Guess();
  EXPECT_TRUE(camera.IsVague());
  EXPECT_THAT(camera.Text(), AllOf(HasSubstr("focal length 554.3 px"), HasSubstr("95 %: 307.9 to 998.0 px"),
                                   HasSubstr("the images do not determine the focal length")));
}

TEST(AutoCamera, IgnoresUntrustedCamera) {
  AutoCamera camera = Guess();
  LearntCamera learnt = Learnt(500.0, 0.2);
  learnt.trusted = false;
  camera.Adopt(learnt);
  EXPECT_EQ(camera.camera.fx, 554.3);
  EXPECT_EQ(camera.deviation, 0.3);
}

TEST(ChooseLearningFrames, StaysWithinFilm) {
  for (const double fps : {1.0, 5.0, 10.0, 24.0, 30.0, 60.0, 240.0}) {
    for (const std::int64_t stride : {1, 2, 7}) {
      for (std::int64_t available = 1; available < 3000; available += 1 + available / 10) {
        const LearningFrames frames = ChooseLearningFrames({10, available, stride}, available, fps);
        EXPECT_GE(frames.second.count, 1);
        EXPECT_LE(frames.first.count, frames.second.count);
        EXPECT_LE(frames.second.count, available);
        EXPECT_EQ(frames.second.stride % stride, 0);
        EXPECT_LE((frames.second.count - 1) * frames.second.stride, (available - 1) * stride);
      }
    }
  }
}

TEST(ChooseLearningFrames, TakesTenFramesOfEachSecondOfFilm) {
  const LearningFrames frames = ChooseLearningFrames({}, 900, 30.0);
  EXPECT_EQ(frames.first.count, 50);
  EXPECT_EQ(frames.second.count, 300);
  EXPECT_EQ(frames.second.stride, 3);
}

TEST(ChooseLearningFrames, PlaysSlowFilmForAsLongAsItLasts) {
  const LearningFrames frames = ChooseLearningFrames({}, 150, 5.0);
  EXPECT_EQ(frames.second.count, 150);
  EXPECT_TRUE(frames.Allow(150));
  EXPECT_FALSE(frames.Allow(151));
}

TEST(ChooseLearningFrames, TakesAllPhotographsAgain) {
  const LearningFrames frames = ChooseLearningFrames({}, 40, 30.0);
  EXPECT_EQ(frames.first.count, 40);
  EXPECT_EQ(frames.second.count, 40);
  EXPECT_EQ(frames.second.stride, 1);
  EXPECT_TRUE(frames.Allow(160));
  EXPECT_FALSE(frames.Allow(161));
}

TEST(ChooseLearningFrames, AllowsFivePassesOfFewPhotographs) {
  const LearningFrames frames = ChooseLearningFrames({}, 11, 30.0);
  EXPECT_TRUE(frames.Allow(44));
  EXPECT_FALSE(frames.Allow(45));
}

TEST(IsSettled, AsksForChangeBelowHalfDeviation) {
  AutoCamera before = Guess();
  before.Adopt(Learnt(554.3, 0.02));
  AutoCamera after = Guess();
  after.Adopt(Learnt(554.3 * 1.009, 0.02));
  EXPECT_TRUE(IsSettled(before, after));
  after.Adopt(Learnt(554.3 * 1.011, 0.02));
  EXPECT_FALSE(IsSettled(before, after));
  EXPECT_TRUE(IsSettled(after, after));
}

TEST(IsSettled, AsksForCoefficientsToo) {
  const AutoCamera before = Guess();
  AutoCamera after = before;
  after.deviation = 0.02;
  after.camera.distortion[0] = -0.01;  // 0.5 % in the corners
  EXPECT_TRUE(IsSettled(before, after));
  after.camera.distortion[0] = -0.03;
  EXPECT_FALSE(IsSettled(before, after));
}

TEST(WithFisheyeLens, SeesThroughWholeImage) {
  const AutoCamera fisheye = WithFisheyeLens(Guess());
  EXPECT_EQ(fisheye.camera.lens, LensModel::kFisheye);
  EXPECT_NEAR(HorizontalFieldOfView(fisheye.camera), 164.0 * 3.14159265 / 180.0, 0.01);
  EXPECT_THAT(fisheye.Text(), HasSubstr("fisheye lens, focal length 224.0 px (163.7 degrees across)"));
}

TEST(WithWideLens, SeesAsMuchAsActionCamera) {
  const AutoCamera wide = WithWideLens(Guess());
  EXPECT_EQ(wide.camera.lens, LensModel::kRadialTangential);
  EXPECT_NEAR(HorizontalFieldOfView(wide.camera), 85.0 * 3.14159265 / 180.0, 0.01);
  EXPECT_THAT(wide.Text(), HasSubstr("a guess from a wide field of view of 85 degrees"));
}

// From images alone: a fisheye lens of 141 degrees, and the pinhole camera that sees the same world.
TEST(LearnCamera, TellsFisheyeLensFromUsualOne) {
  Camera lens{320, 240, 130.0, 130.0, 159.5, 119.5};
  lens.lens = LensModel::kFisheye;
  const TexturedWorld wide({1400, 1060, 130.0, 130.0, 699.5, 529.5});
  const TexturedWorld usual;
  const ThroughLens through_lens(lens, wide.GetCamera());
  std::vector<cv::Mat> seen_wide;
  std::vector<cv::Mat> seen_usually;
  for (const Rigid3d& T_map_camera : HandHeldPath(40)) {
    seen_wide.push_back(through_lens(wide.Render(0, T_map_camera)).bgr);
    seen_usually.push_back(usual.Render(0, T_map_camera).bgr);
  }
  const auto learn = [](const Camera& camera, const std::vector<cv::Mat>& images) {
    const WrittenSequence written(camera, images);
    RunHost host;
    return LearnCamera(OpenSequence({.path = written.Path(), .camera = "auto", .resize = "1"}), {}, {}, host);
  };
  const AutoCamera fisheye = learn(lens, seen_wide);
  EXPECT_EQ(fisheye.camera.lens, LensModel::kFisheye);
  const auto [low, high] = FocalInterval(fisheye.camera.fx, fisheye.deviation);
  EXPECT_LE(low, 130.0);
  EXPECT_GE(high, 130.0);
  EXPECT_LT(high / low, 1.5);  // 3.2 without images
  EXPECT_EQ(learn(usual.GetCamera(), seen_usually).camera.lens, LensModel::kRadialTangential);
}

TEST(ChooseLearningFrames, EndsAfterFirstMinuteOfLongFilm) {
  EXPECT_EQ(ChooseLearningFrames({}, 30000, 30.0).second.count, 600);
}

}  // namespace
}  // namespace sqslam
