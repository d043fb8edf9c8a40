#include "slam/mapping/completion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ranges>

#include "slam/estimation/reprojection_error.h"
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
  bool Fails(Kind kind, std::int64_t submap, std::int64_t leftover, int evidence = 100) {
    bool made = false;
    attempts_.Try(kind, submap, leftover, evidence, [&]() -> std::optional<int> {
      made = true;
      return std::nullopt;
    });
    return made;
  }

  bool stopped_ = false;
  CompletionAttempts attempts_{[this] { return stopped_; }};
};

TEST_F(CompletionAttemptsTest, RepeatsFailuresOnlyWithMoreEvidence) {
  EXPECT_TRUE(Fails(Kind::kTie, 1, 2));
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2));
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2, 110));
  EXPECT_TRUE(Fails(Kind::kTie, 1, 2, 130));
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2, 130));
  EXPECT_TRUE(Fails(Kind::kTie, 2, 1)) << "the other way round";
  EXPECT_TRUE(Fails(Kind::kTie, 1, 3));
  EXPECT_TRUE(Fails(Kind::kLocate, 1, 2));
  EXPECT_TRUE(Fails(Kind::kTwoViews, 1, 2));
}

TEST_F(CompletionAttemptsTest, RepeatsSuccesses) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(attempts_.Try(Kind::kTie, 1, 2, 100, [] { return std::optional(7); }), 7);
  }
}

TEST_F(CompletionAttemptsTest, MakesNoAttemptOnceStopped) {
  stopped_ = true;
  EXPECT_FALSE(Fails(Kind::kTie, 1, 2));
  EXPECT_TRUE(attempts_.Stopped());
}

class CompletionTest : public ::testing::Test {
 protected:
  // Adds the keyframes of a map to the images that are compared.
  void AddViews(const Map& map, std::int64_t group) {
    for (const auto& [id, keyframe] : map.Keyframes()) {
      views_.Add(keyframe.frame_index, keyframe.features, group);
    }
  }
  std::optional<TrackedFrame> Locate(const SyntheticMap& world, const LeftoverFrame& frame) {
    AddViews(world.map, 0);
    views_.Add(frame.index, frame.features);
    views_.Match();
    return completion_.Locate(MakeTrackingView(world.map), completion_.PointsShared(world.map, frame.index),
                              frame);
  }
  std::optional<SubmapTie> Tie(const Map& current, const Map& known) {
    AddViews(known, 0);
    AddViews(current, 1);
    views_.Match();
    return completion_.Tie(current, known, MakeTrackingView(known), completion_.CommonViews(current, known));
  }

  Camera camera_ = SyntheticWorld().camera;
  PoseTracker tracker_{camera_, {}};
  PlaceRecognizer places_{camera_, {}, nullptr};
  ViewGraph views_{camera_, places_};
  Completion completion_{camera_, tracker_, views_};
};

// Half way round the cloud from the nearest keyframe in time.
TEST_F(CompletionTest, LocatesFrameFarFromAllKeyframes) {
  const SyntheticMap world = MakeSyntheticMap({});
  const LeftoverFrame frame{
      40, 4.0, world.See(PoseOnArc(8.0), {.pixel_noise = 0.2, .flipped_bits = 10, .clutter = 200}).features};
  const auto located = Locate(world, frame);
  ASSERT_TRUE(located);
  EXPECT_LT(CenterDistance(located->T_camera_map, PoseOnArc(8.0)), 5.0 * kThousandth);
  EXPECT_GT(located->inliers, 100);
  EXPECT_TRUE(world.map.HasKeyframe(located->anchor.reference));
}

TEST_F(CompletionTest, DoesNotLocateFrameOfOtherWorld) {
  const SyntheticMap world = MakeSyntheticMap({});
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  EXPECT_FALSE(Locate(world, {30, 3.0, elsewhere.See(PoseOnArc(3.0)).features}));
  EXPECT_FALSE(Locate(world, {31, 3.1, SyntheticWorld().See({}).features}));
}

TEST_F(CompletionTest, LocatesFrameOnlyWithinAllowedDeviation) {
  const SyntheticMap world = MakeSyntheticMap({});
  const LeftoverFrame frame{40, 4.0, world.See(PoseOnArc(3.5), {.pixel_noise = 0.2}).features};
  AddViews(world.map, 0);
  views_.Add(frame.index, frame.features);
  views_.Match();
  const SharedPoints shared = completion_.PointsShared(world.map, frame.index);
  const TrackingView view = MakeTrackingView(world.map);
  const auto located = completion_.Locate(view, shared, frame);
  ASSERT_TRUE(located);
  std::vector<Eigen::Vector3d> p_map;
  for (const PointId point : located->points) {
    if (point != kNoPoint) {
      p_map.push_back(world.map.Point(point).p_map);
    }
  }
  const double deviation = CornerDeviation(camera_, located->T_camera_map, p_map);
  EXPECT_FALSE(completion_.Locate(view, shared, frame, 0.9 * deviation));
  EXPECT_TRUE(completion_.Locate(view, shared, frame, 1.1 * deviation));
}

// The four keyframes that share most with a frame have points of their own, three times as far away. A step
// from any of them agrees with its own points, but not with those of the other keyframes.
TEST_F(CompletionTest, PlacesNoFrameByTwoViewsThatOtherKeyframesContradict) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 10});
  const LeftoverFrame frame{40, 4.0, world.See(PoseOnArc(4.5), {.pixel_noise = 0.2}).features};
  AddViews(world.map, 0);
  views_.Add(frame.index, frame.features);
  views_.Match();
  const std::optional<TrackedFrame> placed = completion_.LocateByTwoViews(world.map, frame);
  ASSERT_TRUE(placed);
  EXPECT_LT(CenterDistance(placed->T_camera_map, PoseOnArc(4.5)), 50.0 * kThousandth);
  std::vector<std::pair<std::size_t, std::int64_t>> ranked;
  for (const auto& [other, matches] : views_.MatchesOf(frame.index)) {
    ranked.emplace_back(matches.size(), other);
  }
  std::ranges::sort(ranked, std::greater<>());
  ASSERT_GE(ranked.size(), 9U);
  for (const auto& [count, other] : ranked | std::views::take(4)) {
    const auto keyframe = std::ranges::find_if(
        world.map.Keyframes(), [&](const auto& entry) { return entry.second.frame_index == other; });
    const KeyframeId id = keyframe->first;
    const Eigen::Vector3d center = keyframe->second.Center();
    const std::vector<PointId> points = keyframe->second.points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i] != kNoPoint) {
        const Eigen::Vector3d farther = center + 3.0 * (world.map.Point(points[i]).p_map - center);
        world.map.RemoveObservation(points[i], id);
        world.map.AddObservation(world.map.AddPoint(farther, id), id, static_cast<int>(i));
      }
    }
  }
  EXPECT_FALSE(completion_.LocateByTwoViews(world.map, frame));
}

// Six photographs of a cloud, four of another one.
TEST_F(CompletionTest, FindsStartsThatFurtherViewsConfirm) {
  const SyntheticMap world = MakeSyntheticMap({});
  const SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  LeftoverFrames frames(20);
  for (int i = 0; i < 10; ++i) {
    const SyntheticMap& shown = i < 6 ? world : elsewhere;
    frames.Add({i, 0.1 * i, shown.See(PoseOnArc(i), {.pixel_noise = 0.3}).features});
    views_.Add(i, frames.ByIndex().at(i).features);
  }
  views_.Match();
  EXPECT_TRUE(views_.MatchesOf(0).contains(5));
  EXPECT_FALSE(views_.MatchesOf(0).contains(6));
  const std::vector<StartPair> starts = completion_.Starts(frames);
  ASSERT_FALSE(starts.empty());
  for (const StartPair& start : starts) {
    EXPECT_EQ(start.first < 6, start.second < 6) << start.first << ' ' << start.second;
    EXPECT_LT(start.geometry.direction_deviation, 0.1);
  }
  EXPECT_GT(completion_.ThirdViewSupport(MakeSyntheticMap({.keyframes = 2}).map, frames), 0.8);
  EXPECT_LT(completion_.ThirdViewSupport(MakeSyntheticMap({.keyframes = 2, .seed = 5}).map, frames), 0.2);
}

// The same part of the ring twice, the second time in a frame and unit of its own.
TEST_F(CompletionTest, TiesMapsOfTheSamePlace) {
  const SyntheticMap known = MakeRingMap({.keyframes = 8, .scale_drift = 0.0, .rotation_drift = 0.0});
  SyntheticMap current =
      MakeRingMap({.keyframes = 8, .scale_drift = 0.0, .rotation_drift = 0.0, .first_id = 100});
  current.map.Renumber({.frame = 100});
  const Sim3d S_current_ring{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, 7.0}};
  current.map.Transform(S_current_ring);
  const auto tie = Tie(current.map, known.map);
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
  SyntheticMap elsewhere = MakeSyntheticMap({.seed = 99});
  elsewhere.map.Renumber({.frame = 100});
  EXPECT_FALSE(Tie(elsewhere.map, known.map));
}

}  // namespace
}  // namespace sqslam
