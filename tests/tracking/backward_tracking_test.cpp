#include <gtest/gtest.h>

#include "slam/tracking/pose_tracker.h"
#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::AsTracked;
using testing::CenterDistance;
using testing::MakeSyntheticMap;
using testing::NewFrame;
using testing::PoseOnArc;
using testing::SyntheticMap;
using testing::Turn;

constexpr int kMinInliers = 50;

class BackwardTracking : public ::testing::Test {
 protected:
  // Frames 0 to `count` - 1 come to keyframe 3 along the arc and could not be tracked; keyframe 3 could.
  Backlog Arriving(int count, int flipped_bits = 10) const {
    Backlog backlog;
    backlog.next = AsTracked(world_.map, 3);
    backlog.next.index = count;
    for (int i = 0; i < count; ++i) {
      backlog.earlier.push_back(NewFrame(
          world_
              .See(Truth(i, count),
                   {.pixel_noise = 0.1, .flipped_bits = flipped_bits, .seed = static_cast<std::uint64_t>(i)})
              .features,
          i));
    }
    return backlog;
  }
  static Rigid3d Truth(std::int64_t index, int count) {
    return PoseOnArc(3.0 - 0.15 * static_cast<double>(count - index));
  }
  static void Blank(TrackedFrame& frame) {
    frame = NewFrame(testing::SyntheticWorld().See({}).features, frame.index);
  }
  std::vector<TrackedFrame> Track(const Backlog& backlog) const {
    return TrackBackward(tracker_, MakeTrackingView(world_.map), backlog, kMinInliers);
  }

  SyntheticMap world_ = MakeSyntheticMap({});
  PoseTracker tracker_{world_.camera, {}};
};

TEST_F(BackwardTracking, FindsAllFramesFromNewestToOldest) {
  const std::vector<TrackedFrame> tracked = Track(Arriving(12));
  ASSERT_EQ(tracked.size(), 12U);
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    EXPECT_EQ(tracked[i].index, 11 - static_cast<int>(i));
    EXPECT_LT(CenterDistance(tracked[i].T_camera_map, Truth(tracked[i].index, 12)), 1e-3);
    const ScaledPose reference = world_.map.PoseOf(tracked[i].anchor.reference);
    EXPECT_LT(CenterDistance(Resolve(tracked[i].anchor, reference).T_camera_map, tracked[i].T_camera_map),
              1e-9);
  }
}

TEST_F(BackwardTracking, ContinuesBehindEmptyFrames) {
  Backlog backlog = Arriving(12);
  for (const std::size_t i : {4U, 5U, 6U}) {
    Blank(backlog.earlier[i]);
  }
  const std::vector<TrackedFrame> tracked = Track(backlog);
  ASSERT_EQ(tracked.size(), 9U);
  EXPECT_EQ(tracked.back().index, 0);
  EXPECT_LT(CenterDistance(tracked.back().T_camera_map, Truth(0, 12)), 1e-3);
}

TEST_F(BackwardTracking, StopsAfterTenFramesWithoutPose) {
  Backlog backlog = Arriving(15);
  for (std::size_t i = 2; i < 12; ++i) {
    Blank(backlog.earlier[i]);
  }
  EXPECT_EQ(Track(backlog).size(), 3U);
}

TEST_F(BackwardTracking, CountsOnlyConsecutiveFailures) {
  Backlog backlog = Arriving(20);
  for (std::size_t i = 2; i < 18; ++i) {
    if (i != 10) {
      Blank(backlog.earlier[i]);
    }
  }
  EXPECT_EQ(Track(backlog).size(), 5U);
}

// So many bits that no frame is recognised by the descriptors of a keyframe: only the motion leads from one
// to the next.
constexpr int kManyBits = 60;

TEST_F(BackwardTracking, FollowsFastTurnByItsVelocity) {
  Backlog backlog;
  backlog.next = AsTracked(world_.map, 3);
  const auto truth = [](int i) { return Turn(0.08 * (4 - i), Eigen::Vector3d::UnitX()) * PoseOnArc(3); };
  for (int i = 0; i < 4; ++i) {  // 40 px from one to the next
    backlog.earlier.push_back(NewFrame(
        world_.See(truth(i), {.flipped_bits = kManyBits, .seed = static_cast<std::uint64_t>(i)}).features,
        i));
  }
  const std::vector<TrackedFrame> tracked = Track(backlog);
  ASSERT_EQ(tracked.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT(CenterDistance(tracked[static_cast<std::size_t>(3 - i)].T_camera_map, truth(i)), 1e-3);
  }
}

TEST_F(BackwardTracking, NeedsEnoughInliers) {
  Backlog backlog = Arriving(3);
  backlog.earlier[1] = NewFrame(world_.See(Truth(1, 3)).features, 1);
  EXPECT_EQ(TrackBackward(tracker_, MakeTrackingView(world_.map), backlog, 301).size(), 0U);
}

// While the frames waited, the map was moved, and its points were fused into others.
TEST_F(BackwardTracking, FollowsMovedKeyframes) {
  const Backlog backlog = Arriving(6, kManyBits);
  for (PointId id = 0; id < 300; ++id) {
    const PointId kept = world_.map.AddPoint(world_.points[static_cast<std::size_t>(id)], 0);
    world_.map.Fuse(id, kept);
  }
  const Sim3d S_new_old{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, -30.0}};
  world_.map.Transform(S_new_old);
  const std::vector<TrackedFrame> tracked = Track(backlog);
  ASSERT_EQ(tracked.size(), 6U);
  for (const TrackedFrame& frame : tracked) {
    EXPECT_LT(CenterDistance(frame.T_camera_map, MoveCamera(Truth(frame.index, 6), S_new_old)), 2.5e-3);
    EXPECT_GT(frame.inliers, 250);
  }
}

}  // namespace
}  // namespace sqslam
