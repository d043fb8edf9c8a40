#include "slam/tracking/pose_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::AsTracked;
using testing::CenterDistance;
using testing::MakeSyntheticMap;
using testing::NewFrame;
using testing::PoseOnArc;
using testing::Sight;
using testing::SyntheticMap;
using testing::SyntheticWorld;
using testing::Turn;

constexpr double kMillimetre = 1e-3;
constexpr Sight kPoorSight{.pixel_noise = 0.15, .flipped_bits = 15, .clutter = 200};

class PoseTrackerTest : public ::testing::Test {
 protected:
  TrackedFrame See(double place, const Sight& sight = {}) {
    const SyntheticWorld::View view = world_.See(PoseOnArc(place), sight);
    shown_ = view.points;
    return NewFrame(view.features);
  }
  TrackingView View() const { return MakeTrackingView(world_.map); }

  // Counts the keypoints that were taken for another point than the one they show.
  int WrongMatches(const TrackedFrame& frame) const {
    int wrong = 0;
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      wrong += frame.points[i] != kNoPoint && frame.points[i] != shown_[i] ? 1 : 0;
    }
    return wrong;
  }
  static int Matches(const TrackedFrame& frame) {
    return static_cast<int>(frame.points.size()) -
           static_cast<int>(std::count(frame.points.begin(), frame.points.end(), kNoPoint));
  }

  SyntheticMap world_ = MakeSyntheticMap({});
  PoseTracker tracker_{world_.camera, {}};
  std::vector<int> shown_;  // by the keypoints of the frame seen last
};

TEST_F(PoseTrackerTest, TracksByMotionWithinAMillimetre) {
  TrackedFrame frame = See(3.1, kPoorSight);
  ASSERT_TRUE(tracker_.TrackMotion(View(), AsTracked(world_.map, 3), {}, frame));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(3.1)), kMillimetre);
  EXPECT_GT(frame.inliers, 270);
  EXPECT_EQ(frame.inliers, Matches(frame));
  EXPECT_EQ(WrongMatches(frame), 0);
  EXPECT_EQ(frame.anchor.reference, 3);
}

TEST_F(PoseTrackerTest, PredictsByGivenMotion) {
  // The camera turns by 23 degrees: 200 px, farther than any search for a camera that stands would reach.
  const Rigid3d turn = Turn(0.4, Eigen::Vector3d::UnitX());
  TrackedFrame frame = NewFrame(world_.See(turn * PoseOnArc(3)).features);
  EXPECT_FALSE(tracker_.TrackMotion(View(), AsTracked(world_.map, 3), {}, frame));
  ASSERT_TRUE(tracker_.TrackMotion(View(), AsTracked(world_.map, 3), turn, frame));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(3)), kMillimetre);
}

TEST_F(PoseTrackerTest, WidensSearchWhenPredictionIsPoor) {
  TrackedFrame frame = See(4.0);  // some 20 to 40 px away
  ASSERT_TRUE(tracker_.TrackMotion(View(), AsTracked(world_.map, 3), {}, frame));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(4.0)), kMillimetre);
}

TEST_F(PoseTrackerTest, DropsMatchesThatDoNotFit) {
  TrackedFrame frame = See(3.1);
  FrameFeatures features = *frame.features;
  std::swap(features.descriptors[10], features.descriptors[11]);
  features.keypoints[20].pixel.x() += 9.0;
  features.grid = KeypointGrid(features.keypoints, world_.camera.width, world_.camera.height);
  frame = NewFrame(std::make_shared<const FrameFeatures>(features));
  ASSERT_TRUE(tracker_.TrackMotion(View(), AsTracked(world_.map, 3), {}, frame));
  EXPECT_EQ(frame.points[10], kNoPoint);
  EXPECT_EQ(frame.points[11], kNoPoint);
  EXPECT_EQ(frame.points[20], kNoPoint);
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(3.1)), 1e-5);
}

TEST_F(PoseTrackerTest, FindsNothingInOtherWorld) {
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  TrackedFrame frame = NewFrame(elsewhere.See(PoseOnArc(3)).features);
  const TrackingView view = View();
  EXPECT_FALSE(tracker_.TrackMotion(view, AsTracked(world_.map, 3), {}, frame));
  EXPECT_FALSE(tracker_.TrackReferenceKeyframe(view, AsTracked(world_.map, 3), frame));
  EXPECT_FALSE(tracker_.Relocate(view, view.keyframes.at(3), frame));
  TrackedFrame blank = NewFrame(SyntheticWorld().See({}).features);
  EXPECT_FALSE(tracker_.TrackReferenceKeyframe(view, AsTracked(world_.map, 3), blank));
}

TEST_F(PoseTrackerTest, TracksAcrossLargeStepWithoutPrediction) {
  // Half way round the cloud and turned in the image plane: no motion model leads there.
  const Rigid3d turn = Turn(0.5, Eigen::Vector3d::UnitZ()) * Turn(0.3, Eigen::Vector3d::UnitX());
  const SyntheticWorld::View seen = world_.See(turn * PoseOnArc(5.0), kPoorSight);
  shown_ = seen.points;
  TrackedFrame frame = NewFrame(seen.features);
  const TrackedFrame last = AsTracked(world_.map, 0);
  ASSERT_FALSE(tracker_.TrackMotion(View(), last, {}, frame));
  SeenPoints points;
  ASSERT_TRUE(tracker_.TrackWithoutPrediction(View(), last, frame, points));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(5.0)), kMillimetre);
  EXPECT_EQ(WrongMatches(frame), 0);
  EXPECT_GT(points.found.size(), 100U);
}

TEST_F(PoseTrackerTest, TriesNewestKeyframesWithoutPrediction) {
  // The last frame knows no point any more, and its reference keyframe is gone.
  TrackedFrame last = AsTracked(world_.map, 3);
  last.ClearPoints();
  last.anchor.reference = 77;
  TrackedFrame frame = See(4.6, kPoorSight);
  SeenPoints points;
  ASSERT_TRUE(tracker_.TrackWithoutPrediction(View(), last, frame, points));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(4.6)), kMillimetre);
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  TrackedFrame other = NewFrame(elsewhere.See(PoseOnArc(3)).features);
  EXPECT_FALSE(tracker_.TrackWithoutPrediction(View(), last, other, points));
}

TEST_F(PoseTrackerTest, TracksReferenceKeyframeAfterAnyMotion) {
  const Rigid3d turn = Turn(0.25, Eigen::Vector3d::UnitX());
  const SyntheticWorld::View seen = world_.See(turn * PoseOnArc(4.5), kPoorSight);
  shown_ = seen.points;
  TrackedFrame frame = NewFrame(seen.features);
  ASSERT_TRUE(tracker_.TrackReferenceKeyframe(View(), AsTracked(world_.map, 3), frame));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(4.5)), kMillimetre);
  EXPECT_EQ(WrongMatches(frame), 0);
  EXPECT_EQ(frame.anchor.reference, 3);
}

TEST_F(PoseTrackerTest, UsesNewestKeyframeWhenReferenceIsGone) {
  TrackedFrame last = AsTracked(world_.map, 3);
  world_.map.RemoveKeyframe(3);
  TrackedFrame frame = See(3.5);
  ASSERT_TRUE(tracker_.TrackReferenceKeyframe(View(), last, frame));
  EXPECT_EQ(frame.anchor.reference, 5);
}

// Only every fifth point is known from the frame before; the local map finds the others.
TEST_F(PoseTrackerTest, TracksLocalMapAndAnchorsFrame) {
  TrackedFrame frame = See(2.2, kPoorSight);
  frame.T_camera_map = PoseOnArc(2.21);
  frame.anchor.reference = 2;
  for (std::size_t i = 0; i < 300; i += 5) {
    frame.points[i] = shown_[i];
  }
  SeenPoints seen;
  ASSERT_TRUE(tracker_.TrackLocalMap(View(), {.min_inliers = 50}, frame, seen));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(2.2)), kMillimetre);
  EXPECT_GT(frame.inliers, 270);
  EXPECT_EQ(WrongMatches(frame), 0);
  EXPECT_EQ(static_cast<int>(seen.found.size()), frame.inliers);
  EXPECT_EQ(seen.visible.size(), world_.points.size());
  const ScaledPose reference = world_.map.PoseOf(frame.anchor.reference);
  EXPECT_LT(CenterDistance(Resolve(frame.anchor, reference).T_camera_map, frame.T_camera_map), 1e-9);
}

TEST_F(PoseTrackerTest, ExpectsOnlyVisiblePoints) {
  // The camera has turned until only some of the points are in the image.
  const Rigid3d turn = Turn(0.6, Eigen::Vector3d::UnitY());
  const SyntheticWorld::View view = world_.See(turn * PoseOnArc(2));
  TrackedFrame frame = NewFrame(view.features);
  frame.T_camera_map = turn * PoseOnArc(2);
  frame.anchor.reference = 2;
  // Two of them look the other way, or were seen from far nearer.
  ASSERT_GT(view.points.size(), 40U);
  ASSERT_LT(view.points.size(), 200U);
  world_.map.Point(view.points[0]).normal *= -1.0;
  world_.map.Point(view.points[1]).max_distance = 1.0;
  SeenPoints seen;
  ASSERT_TRUE(tracker_.TrackLocalMap(View(), {.min_inliers = 30}, frame, seen));
  std::sort(seen.visible.begin(), seen.visible.end());
  EXPECT_EQ(seen.visible, std::vector<PointId>(view.points.begin() + 2, view.points.end()));
}

TEST_F(PoseTrackerTest, DiscardsEarlierMatchesWhenSearchingAnew) {
  TrackedFrame frame = See(2.0);
  frame.T_camera_map = PoseOnArc(2.0);
  frame.anchor.reference = 2;
  std::rotate_copy(shown_.begin(), shown_.begin() + 1, shown_.end(), frame.points.begin());  // all wrong
  SeenPoints seen;
  ASSERT_TRUE(tracker_.TrackLocalMap(View(), {.discard_matches = true, .min_inliers = 50}, frame, seen));
  EXPECT_EQ(Matches(frame), 300);
  EXPECT_EQ(WrongMatches(frame), 0);
}

TEST_F(PoseTrackerTest, NeedsEnoughInliers) {
  TrackedFrame frame = See(2.0);
  frame.T_camera_map = PoseOnArc(2.0);
  SeenPoints seen;
  EXPECT_TRUE(tracker_.TrackLocalMap(View(), {.min_inliers = 300}, frame, seen));
  EXPECT_FALSE(tracker_.TrackLocalMap(View(), {.min_inliers = 301}, frame, seen));
}

TEST_F(PoseTrackerTest, RelocatesWithinAMillimetre) {
  const TrackingView view = View();
  for (const double place : {0.3, 2.5, 4.7}) {
    const Rigid3d turn = Turn(0.2, Eigen::Vector3d::UnitZ());
    const SyntheticWorld::View seen = world_.See(turn * PoseOnArc(place), kPoorSight);
    shown_ = seen.points;
    TrackedFrame frame = NewFrame(seen.features);
    ASSERT_TRUE(tracker_.Relocate(view, view.keyframes.at(2), frame)) << place;
    EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(place)), kMillimetre) << place;
    EXPECT_GT(frame.inliers, 270);
    EXPECT_EQ(WrongMatches(frame), 0);
  }
}

// A map in another frame and unit is tracked in the same way, and gives the same pose in that frame.
TEST_F(PoseTrackerTest, CommutesWithASimilarity) {
  const Sim3d S_new_old{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, 7.0}};
  TrackedFrame frame = See(2.4, kPoorSight);
  TrackedFrame moved = frame;
  TrackedFrame relocated = frame;
  SeenPoints seen;
  ASSERT_TRUE(tracker_.TrackMotion(View(), AsTracked(world_.map, 2), {}, frame));
  ASSERT_TRUE(tracker_.TrackLocalMap(View(), {}, frame, seen));
  world_.map.Transform(S_new_old);
  const TrackingView view = View();
  ASSERT_TRUE(tracker_.TrackMotion(view, AsTracked(world_.map, 2), {}, moved));
  ASSERT_TRUE(tracker_.TrackLocalMap(view, {}, moved, seen));
  ASSERT_TRUE(tracker_.Relocate(view, view.keyframes.at(2), relocated));
  EXPECT_LT(CenterDistance(moved.T_camera_map, MoveCamera(frame.T_camera_map, S_new_old)), 1e-4);
  EXPECT_LT(CenterDistance(relocated.T_camera_map, MoveCamera(frame.T_camera_map, S_new_old)), 1e-4);
  EXPECT_EQ(moved.points, frame.points);
  EXPECT_NEAR(moved.anchor.scale, 2.5, 1e-12);
}

TEST_F(PoseTrackerTest, LocatesByGivenMatches) {
  TrackedFrame frame = See(7.0, {.pixel_noise = 0.15, .flipped_bits = 15, .clutter = 500});
  const TrackingView view = View();
  std::vector<std::pair<PointId, int>> matches;  // the world's points come first, in the order of keyframe 5
  for (int i = 0; i < 60; ++i) {
    matches.emplace_back(view.keyframes.at(5).points[i], i);
  }
  ASSERT_TRUE(tracker_.LocateFrom(view, matches, 5, 100, frame));
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(7.0)), 2.0 * kMillimetre);
  EXPECT_EQ(WrongMatches(frame), 0);
  EXPECT_FALSE(tracker_.LocateFrom(view, {}, 5, 20, frame));
}

// A pose that only a few points hold, far from the truth, gives way to the one that descriptors lead to.
TEST_F(PoseTrackerTest, RechecksWideStepThatFindsFewPoints) {
  const TrackedFrame last = AsTracked(world_.map, 0);
  const Rigid3d turn = Turn(0.3, Eigen::Vector3d::UnitX());
  TrackedFrame frame = NewFrame(world_.See(turn * PoseOnArc(3.0)).features);
  frame.anchor = last.anchor;
  frame.T_camera_map = turn * PoseOnArc(2.0);
  frame.inliers = 30;
  SeenPoints seen;
  for (PointId id = 0; id < 300; ++id) {
    seen.visible.push_back(id);
  }
  seen.found.assign(seen.visible.begin(), seen.visible.begin() + frame.inliers);
  tracker_.RecheckWideStep(View(), last, frame, seen);
  EXPECT_LT(CenterDistance(frame.T_camera_map, PoseOnArc(3.0)), kMillimetre);
  EXPECT_GT(seen.found.size(), 100U);
}

// A tenth of the points in view find a keypoint near any wrong prediction.
TEST(IsChance, TellsFewPointsOfThoseInView) {
  SeenPoints seen{.visible = std::vector<PointId>(300), .found = std::vector<PointId>(30)};
  EXPECT_TRUE(PoseTracker::IsChance(seen));
  seen.found.resize(90);
  EXPECT_FALSE(PoseTracker::IsChance(seen));
}

}  // namespace
}  // namespace sqslam
