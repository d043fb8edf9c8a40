#include "slam/mapping/completion.h"

#include <gtest/gtest.h>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CenterDistance;
using testing::MakeRingMap;
using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::PoseOnRing;
using testing::RingMapOptions;
using testing::SyntheticMap;
using testing::SyntheticWorld;

constexpr double kThousandth = 1e-3;

TEST(LeftoverFrames, KeepsAllFramesUpToTheMaximum) {
  LeftoverFrames frames(8);
  for (int i = 0; i < 8; ++i) {
    frames.Add({i, 0.1 * i, nullptr});
  }
  EXPECT_EQ(frames.ByIndex().size(), 8U);
  frames.Remove(3);
  EXPECT_FALSE(frames.ByIndex().contains(3));
}

TEST(LeftoverFrames, ThinsFramesEvenly) {
  LeftoverFrames frames(8);
  for (int i = 0; i < 64; ++i) {
    frames.Add({i, 0.1 * i, nullptr});
  }
  const std::vector<std::int64_t> indices = frames.Indices();
  ASSERT_GE(indices.size(), 4U);
  EXPECT_LE(indices.size(), 8U);
  for (std::size_t i = 1; i < indices.size(); ++i) {
    EXPECT_EQ(indices[i] - indices[i - 1], indices[1] - indices[0]);
  }
}

TEST(LeftoverFrames, KeepsNothingWhenCompletionIsOff) {
  LeftoverFrames frames(0);
  frames.Add({1, 0.1, nullptr});
  EXPECT_TRUE(frames.ByIndex().empty());
}

class CompletionAttemptsTest : public ::testing::Test {
 protected:
  using Kind = CompletionAttempts::Kind;

  // Makes an attempt that fails; returns false if it was not made.
  bool Fails(Kind kind, std::int64_t submap, std::int64_t leftover) {
    bool made = false;
    attempts_.Try(kind, submap, leftover, [&]() -> std::optional<int> {
      made = true;
      return std::nullopt;
    });
    return made;
  }

  bool stopped_ = false;
  CompletionAttempts attempts_{[this] { return stopped_; }};
};

TEST_F(CompletionAttemptsTest, RepeatsFailuresOnlyWhenAMapHasChanged) {
  EXPECT_TRUE(Fails(Kind::kTie, 1, 2));
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2));
  EXPECT_TRUE(Fails(Kind::kTie, 2, 1)) << "the other way round";
  EXPECT_TRUE(Fails(Kind::kTie, 1, 3));
  EXPECT_TRUE(Fails(Kind::kLocate, 1, 2));
  EXPECT_TRUE(Fails(Kind::kTwoViews, 1, 2));
  EXPECT_TRUE(Fails(Kind::kLocate, 4, 1)) << "frame 1";
  attempts_.ForgetFailuresIn(2);
  EXPECT_TRUE(Fails(Kind::kTie, 1, 2));
  EXPECT_FALSE(Fails(Kind::kTie, 1, 3));
  EXPECT_FALSE(Fails(Kind::kLocate, 1, 2)) << "2 is a frame there";
  attempts_.ForgetFailuresIn(1);
  EXPECT_TRUE(Fails(Kind::kTie, 1, 3));
  EXPECT_TRUE(Fails(Kind::kLocate, 1, 2));
  EXPECT_FALSE(Fails(Kind::kLocate, 4, 1));
}

TEST_F(CompletionAttemptsTest, RepeatsSuccesses) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(attempts_.Try(Kind::kTie, 1, 2, [] { return std::optional(7); }), 7);
  }
}

TEST_F(CompletionAttemptsTest, MakesNoAttemptOnceStopped) {
  stopped_ = true;
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2));
}

class CompletionTest : public ::testing::Test {
 protected:
  Camera camera_ = SyntheticWorld().camera;
  PoseTracker tracker_{camera_, {}};
  PlaceRecognizer places_{camera_, {}, nullptr};
  Completion completion_{camera_, tracker_, places_};
};

// Half way round the cloud from the nearest keyframe in time.
TEST_F(CompletionTest, LocatesFrameFarFromAllKeyframes) {
  const SyntheticMap world = MakeSyntheticMap({});
  const LeftoverFrame frame{
      40, 4.0, world.See(PoseOnArc(8.0), {.pixel_noise = 0.2, .flipped_bits = 10, .clutter = 200}).features};
  const auto located = completion_.Locate(world.map, MakeTrackingView(world.map), frame);
  ASSERT_TRUE(located);
  EXPECT_LT(CenterDistance(located->T_camera_map, PoseOnArc(8.0)), 5.0 * kThousandth);
  EXPECT_GT(located->inliers, 100);
  EXPECT_TRUE(world.map.HasKeyframe(located->anchor.reference));
}

TEST_F(CompletionTest, DoesNotLocateFrameOfOtherWorld) {
  const SyntheticMap world = MakeSyntheticMap({});
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  EXPECT_FALSE(completion_.Locate(world.map, MakeTrackingView(world.map),
                                  {7, 0.7, elsewhere.See(PoseOnArc(3.0)).features}));
  EXPECT_FALSE(completion_.Locate(world.map, MakeTrackingView(world.map),
                                  {7, 0.7, SyntheticWorld().See({}).features}));
}

TEST_F(CompletionTest, OrdersFramesByDistanceInTime) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 3});  // frames 0, 1 and 2
  LeftoverFrames frames(10);
  for (const int index : {30, 4, 12}) {
    frames.Add({index, 0.1 * index, nullptr});
  }
  EXPECT_EQ(completion_.ByDistanceInTime(world.map, frames), (std::vector<std::int64_t>{4, 12, 30}));
}

// The same part of the ring twice, the second time in a frame and unit of its own.
TEST_F(CompletionTest, TiesMapsOfTheSamePlace) {
  const SyntheticMap known = MakeRingMap({.keyframes = 8, .scale_drift = 0.0, .rotation_drift = 0.0});
  SyntheticMap current =
      MakeRingMap({.keyframes = 8, .scale_drift = 0.0, .rotation_drift = 0.0, .first_id = 100});
  const Sim3d S_current_ring{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, 7.0}};
  current.map.Transform(S_current_ring);
  const auto tie = completion_.Tie(current.map, known.map, MakeTrackingView(known.map));
  ASSERT_TRUE(tie);
  EXPECT_TRUE(current.map.HasKeyframe(tie->loop.current));
  EXPECT_TRUE(known.map.HasKeyframe(tie->loop.known));
  EXPECT_GE(tie->shared_points, Completion::kMinSharedPoints);
  const Sim3d S_current_known = Sim3d::FromRigid(current.map.At(tie->loop.current).T_camera_map).Inverse() *
                                tie->loop.S_current_known *
                                Sim3d::FromRigid(known.map.At(tie->loop.known).T_camera_map);
  EXPECT_NEAR(S_current_known.scale / S_current_ring.scale, 1.0, 0.01);
  EXPECT_LT(
      (S_current_known * Eigen::Vector3d(1.0, 2.0, 0.5) - S_current_ring * Eigen::Vector3d(1.0, 2.0, 0.5))
          .norm(),
      20.0 * kThousandth * S_current_ring.scale);
}

TEST_F(CompletionTest, DoesNotTieMapsOfDifferentPlaces) {
  const SyntheticMap known = MakeSyntheticMap({});
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  EXPECT_FALSE(completion_.Tie(elsewhere.map, known.map, MakeTrackingView(known.map)));
}

}  // namespace
}  // namespace sqslam
