#include "slam/mapping/submap.h"

#include <gtest/gtest.h>

#include "slam/geometry/lie.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

constexpr int kMinInliers = 25;
constexpr KeyframeId kReference = 2;
constexpr std::int64_t kOlder = 100;  // frames that see what the reference keyframe sees, from the same place
constexpr std::int64_t kNewer = 101;

class SubmapFrames : public ::testing::Test {
 protected:
  // Tracking has put both frames a little beside their places.
  SubmapFrames() {
    SyntheticMap world = MakeSyntheticMap({});
    camera_ = world.camera;
    truth_ = world.T_camera_map[kReference].Inverse();
    TrackedFrame frame;
    frame.features = world.map.At(kReference).features;
    frame.points = world.map.At(kReference).points;
    const std::vector<FrameMatch> matches = MatchesOf(frame, world.map.Levels());
    submap_ = std::make_unique<Submap>(0, std::make_unique<Map>(std::move(world.map)), SystemOptions{});
    Vector6d delta;
    delta << 0.01, -0.02, 0.01, 0.03, -0.02, 0.04;
    for (const std::int64_t index : {kOlder, kNewer}) {
      submap_->RecordFrame(index, 0.1 * static_cast<double>(index), {kReference, Perturb({}, delta)},
                           matches);
    }
  }
  double Error(std::int64_t frame) const {
    return (submap_->FramePose(frame)->translation - truth_.translation).norm();
  }

  Camera camera_;
  Rigid3d truth_;  // T_map_camera of both frames
  std::unique_ptr<Submap> submap_;
};

TEST_F(SubmapFrames, AreRefinedAtTheEnd) {
  EXPECT_GT(Error(kOlder), 0.01);
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_LT(Error(kOlder), 1e-5);
  EXPECT_LT(Error(kNewer), 1e-5);
}

TEST_F(SubmapFrames, AreRefinedWhenTheyAreNoLongerAmongTheNewest) {
  submap_->RefineFrames(camera_, kMinInliers, 1);
  EXPECT_LT(Error(kOlder), 1e-5);
  EXPECT_GT(Error(kNewer), 0.01);
  submap_->RefineFrames(camera_, kMinInliers, submap_->NumFrames());
  EXPECT_GT(Error(kNewer), 0.01);
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_LT(Error(kNewer), 1e-5);
}

TEST_F(SubmapFrames, FollowTheirKeyframesFromThenOn) {
  submap_->RefineFrames(camera_, kMinInliers, 1);
  Map& map = submap_->Map();
  const Eigen::Vector3d shift(0.5, 0.0, 0.0);
  map.At(kReference).T_camera_map.translation -= map.At(kReference).T_camera_map.rotation * shift;
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_NEAR(Error(kOlder), 0.5, 1e-5);  // what it matched is forgotten
  EXPECT_LT(Error(kNewer), 1e-5);         // is found among the points, which have stayed
}

}  // namespace
}  // namespace sqslam
