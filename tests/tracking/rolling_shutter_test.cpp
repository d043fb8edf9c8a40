#include "slam/tracking/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sqslam {
namespace {

constexpr double kInterval = 1.0 / 30.0;  // s

Camera TestCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 520.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

// A camera that swings before random points, and reads its rows over `readout` seconds with `noise` pixels.
class SwingingCamera {
 public:
  SwingingCamera(double readout, double noise) : readout_(readout), noise_(0.0, noise) {
    std::uniform_real_distribution<double> side(-1.5, 1.5);
    std::uniform_real_distribution<double> depth(1.5, 4.0);
    for (int i = 0; i < 600; ++i) {
      points_.emplace_back(side(random_), side(random_), depth(random_));
    }
  }

  static Rigid3d PoseAt(double seconds) {
    const Eigen::Vector3d turn(0.08 * std::sin(4.1 * seconds), 0.15 * std::sin(2.7 * seconds),
                               0.05 * std::sin(3.3 * seconds));
    return {ExpRotation(turn), {0.2 * std::sin(2.3 * seconds), 0.1 * std::sin(3.1 * seconds), 0.0}};
  }

  struct View {
    FrameFeaturesPtr features;
    std::vector<Eigen::Vector2d> at_once;  // where a global shutter would see the keypoints
    CameraMotion motion;
    std::vector<ShutterObservation> observations;
  };

  View Frame(int index) {
    const double time = index * kInterval;
    const Rigid3d T_camera_map = PoseAt(time);
    auto features = std::make_shared<FrameFeatures>();
    View view;
    for (const Eigen::Vector3d& p_map : points_) {
      Eigen::Vector2d pixel = camera_.Project(T_camera_map * p_map);
      const Eigen::Vector2d at_once = pixel;
      for (int i = 0; i < 5; ++i) {  // the row says when, when says the row
        const double delay = readout_ * ((pixel.y() + 0.5) / camera_.height - 0.5);
        pixel = camera_.Project(PoseAt(time + delay) * p_map);
      }
      if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > 639.0 || pixel.y() > 479.0) {
        continue;
      }
      pixel += Eigen::Vector2d(noise_(random_), noise_(random_));
      view.observations.push_back({static_cast<int>(features->Size()), T_camera_map * p_map, 1.0});
      features->keypoints.push_back({pixel, pixel, 0.0F, 0});
      view.at_once.push_back(at_once);
    }
    view.features = features;
    view.motion = CameraMotion::Between(PoseAt(time - kInterval), T_camera_map, kInterval);
    return view;
  }

 private:
  Camera camera_ = TestCamera();
  double readout_;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_;
  std::vector<Eigen::Vector3d> points_;
};

double MeanError(const SwingingCamera::View& view, const FrameFeatures& features) {
  double sum = 0.0;
  for (std::size_t i = 0; i < features.Size(); ++i) {
    sum += (features.keypoints[i].pixel - view.at_once[i]).norm();
  }
  return sum / static_cast<double>(features.Size());
}

void LearnFrames(SwingingCamera& world, int count, RollingShutter& shutter) {
  for (int i = 1; i <= count; ++i) {
    const SwingingCamera::View view = world.Frame(i);
    shutter.Learn(*view.features, view.motion, view.observations);
  }
}

TEST(RollingShutter, LearnsTheReadoutTime) {
  for (const double readout : {0.027, 0.012, -0.020}) {
    SwingingCamera world(readout, 0.5);
    RollingShutter shutter(TestCamera(), {});
    LearnFrames(world, 60, shutter);
    EXPECT_NEAR(shutter.Readout(), readout, 0.05 * std::abs(readout));
  }
}

// The box of what lies in one part of the image, as the rows show it and as they would be seen at once.
TEST(RollingShutter, CorrectsBoxEdgesToGlobalShutter) {
  SwingingCamera world(0.027, 0.0);
  const RollingShutter shutter(TestCamera(), {.estimate = false, .readout_ms = 27.0});
  double before = 0.0;
  double after = 0.0;
  for (const int index : {8, 15, 31}) {
    const SwingingCamera::View view = world.Frame(index);
    for (const bool upper : {true, false}) {
      Eigen::AlignedBox2d seen;
      Eigen::AlignedBox2d at_once;
      double depth = 0.0;
      int count = 0;
      for (const ShutterObservation& o : view.observations) {
        const Eigen::Vector2d& pixel = view.features->keypoints[static_cast<std::size_t>(o.keypoint)].pixel;
        if (std::abs(pixel.x() - 320.0) < 80.0 && std::abs(pixel.y() - (upper ? 60.0 : 420.0)) < 50.0) {
          seen.extend(pixel);
          at_once.extend(view.at_once[static_cast<std::size_t>(o.keypoint)]);
          depth += o.p_camera.z();
          ++count;
        }
      }
      const Box2d corrected = shutter.Correct(
          {seen.min().x(), seen.min().y(), seen.sizes().x(), seen.sizes().y()}, view.motion, depth / count);
      const Eigen::Vector2d corner(corrected.x, corrected.y);
      const Eigen::Vector2d opposite(corrected.x + corrected.width, corrected.y + corrected.height);
      before += (seen.min() - at_once.min()).norm() + (seen.max() - at_once.max()).norm();
      after += (corner - at_once.min()).norm() + (opposite - at_once.max()).norm();
    }
  }
  EXPECT_GT(before, 6.0);
  EXPECT_LT(after, 0.4 * before);
}

TEST(RollingShutter, CorrectsKeypointsToGlobalShutter) {
  SwingingCamera world(0.027, 0.0);
  RollingShutter shutter(TestCamera(), {.estimate = false, .readout_ms = 27.0});
  for (const int index : {8, 15, 31}) {
    const SwingingCamera::View view = world.Frame(index);
    const FrameFeaturesPtr corrected = shutter.Correct(view.features, view.motion, view.observations);
    EXPECT_LT(MeanError(view, *corrected), 0.25 * MeanError(view, *view.features)) << index;
  }
}

TEST(RollingShutter, DoesNotCorrectGlobalShutter) {
  SwingingCamera world(0.0, 0.5);
  RollingShutter shutter(TestCamera(), {});
  LearnFrames(world, 60, shutter);
  EXPECT_EQ(shutter.Readout(), 0.0);
  const SwingingCamera::View view = world.Frame(70);
  EXPECT_EQ(shutter.Correct(view.features, view.motion, view.observations), view.features);
}

TEST(RollingShutter, RejectsMotionOfFramesWithWrongTimestamps) {
  const RollingShutter at_once(TestCamera(), {});
  const RollingShutter in_rows(TestCamera(), {.estimate = false, .readout_ms = 30.0});
  const Rigid3d last{};
  Rigid3d current{};
  current.translation.x() = 0.01;
  const auto motion = at_once.Motion(last, current, kInterval);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->velocity.x(), 0.3, 1e-9);
  EXPECT_TRUE(at_once.Motion(last, current, 1.0 / 240.0));
  EXPECT_TRUE(in_rows.Motion(last, current, 1.0 / 60.0));
  EXPECT_FALSE(in_rows.Motion(last, current, 0.014)) << "less than half the time that it takes to read one";
  for (const double seconds : {-1.0, 0.0, 1e-6, 1e-3, 0.25}) {
    EXPECT_FALSE(at_once.Motion(last, current, seconds)) << seconds;
    EXPECT_FALSE(in_rows.Motion(last, current, seconds)) << seconds;
  }
}

// The correction of a ray far off the axis is large, and a saved map holds no pixel beyond kMaxKeypoint.
TEST(RollingShutter, LeavesKeypointsThatWouldLeaveTheImage) {
  const RollingShutter shutter(TestCamera(), {.estimate = false, .readout_ms = 27.0});
  FrameFeatures features;
  features.keypoints.push_back({{kMaxKeypoint - 1.0, 200.0}, {630.0, 470.0}, 0.0F, 0});
  features.keypoints.push_back({{300.0, 200.0}, {300.0, 470.0}, 0.0F, 0});
  CameraMotion motion;
  const std::vector<ShutterObservation> observations = {{1, {0.0, 0.0, 2.0}, 1.0}};
  for (const double side : {-1.0, 1.0}) {
    motion.turn.y() = side;
    const FrameFeaturesPtr corrected =
        shutter.Correct(std::make_shared<const FrameFeatures>(features), motion, observations);
    EXPECT_TRUE(IsInReach(corrected->keypoints[0].pixel)) << corrected->keypoints[0].pixel.transpose();
    EXPECT_NE(corrected->keypoints[1].pixel, features.keypoints[1].pixel);
  }
}

TEST(RollingShutter, LearnsNothingFromStaticCamera) {
  SwingingCamera world(0.027, 0.5);
  RollingShutter shutter(TestCamera(), {});
  for (int i = 1; i <= 60; ++i) {
    const SwingingCamera::View view = world.Frame(i);
    shutter.Learn(*view.features, CameraMotion{}, view.observations);
  }
  EXPECT_EQ(shutter.Readout(), 0.0);
}

TEST(RollingShutter, KeepsKnownReadoutTimeWhenEstimationIsOff) {
  SwingingCamera world(0.0, 0.5);
  RollingShutter shutter(TestCamera(), {.estimate = false, .readout_ms = 20.0});
  LearnFrames(world, 30, shutter);
  EXPECT_DOUBLE_EQ(shutter.Readout(), 0.020);
}

TEST(RollingShutter, StartsWithReadoutTimeOfOptionOrCamera) {
  Camera camera = TestCamera();
  camera.readout_ms = 25.0;
  EXPECT_DOUBLE_EQ(RollingShutter(camera, {}).Readout(), 0.025);
  EXPECT_DOUBLE_EQ(RollingShutter(camera, {.readout_ms = 18.0}).Readout(), 0.018);
}

TEST(RollingShutter, CorrectsWrongReadoutTimeOfCameraFile) {
  SwingingCamera world(0.0, 0.5);
  Camera camera = TestCamera();
  camera.readout_ms = 25.0;
  RollingShutter shutter(camera, {});
  LearnFrames(world, 60, shutter);
  EXPECT_EQ(shutter.Readout(), 0.0);
}

}  // namespace
}  // namespace sqslam
