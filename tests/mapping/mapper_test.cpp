#include "slam/mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/mapping/mapper_fixture.h"
#include "tests/support/synthetic_map.h"
#include "tests/support/tracked_frame.h"

namespace sqslam {
namespace {

using testing::AsTracked;
using testing::CenterDistance;
using testing::ExactRing;
using testing::kFirstPoints;
using testing::MakeRingMap;
using testing::MakeSyntheticMap;
using testing::MapperTest;
using testing::NewFrame;
using testing::PoseOnArc;
using testing::RingMapOptions;

constexpr double kOneMillimetre = 1e-3;

TEST_F(MapperTest, DoesNothingBeforeAMapHasBegun) {
  mapper_->Process(Report(0));
  SeenObjects objects;
  mapper_->Process(objects);
  EXPECT_EQ(atlas_, nullptr);
  EXPECT_TRUE(snapshots_.empty());
  EXPECT_TRUE(mapper_->Finish().empty());
}

TEST_F(MapperTest, PublishesTheFirstTwoKeyframesAtOnce) {
  Begin();
  ASSERT_NE(atlas_, nullptr);
  EXPECT_EQ(View().keyframes.size(), 2U);
  EXPECT_EQ(atlas_->origins.at(0).submap, 0);
  ASSERT_FALSE(snapshots_.empty());
  EXPECT_EQ(snapshots_.front()->keyframes.size(), 2U);
  EXPECT_EQ(snapshots_.front()->points.size(), kFirstPoints);
}

TEST_F(MapperTest, TriangulatesMissingPoints) {
  Begin();
  Walk(4);
  EXPECT_EQ(View().keyframes.rbegin()->first, 4);
  const ViewKeyframe& newest = View().keyframes.rbegin()->second;
  EXPECT_LT(CenterDistance(newest.pose.T_camera_map, PoseOnArc(4)), 5.0 * kOneMillimetre);
  EXPECT_GT(std::count_if(newest.points.begin() + kFirstPoints, newest.points.end(),
                          [](PointId point) { return point != kNoPoint; }),
            90);
  std::vector<double> errors;
  for (std::size_t i = 0; i < newest.points.size(); ++i) {
    if (newest.points[i] != kNoPoint) {
      errors.push_back((View().Point(newest.points[i]).p_map - world_.points[i]).norm());
    }
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 10.0 * kOneMillimetre);
  EXPECT_LT(errors.back(), 0.1);
}

TEST_F(MapperTest, GivesEveryTrackedFrameAPose) {
  Begin();
  Walk(4);
  mapper_->Process(Report(9));  // lost
  const std::vector<FinishedMap> finished = mapper_->Finish();
  ASSERT_EQ(finished.size(), 1U);
  const Trajectory& trajectory = finished[0].trajectory;
  ASSERT_EQ(trajectory.size(), 8U);  // 0, 1, and 3 to 8
  for (const TimedPose& pose : trajectory) {
    const auto index = static_cast<int>(std::lround(30.0 * pose.timestamp));
    const double place = index < 2 ? index : 0.5 * index;
    EXPECT_LT(CenterDistance(pose.T_map_camera.Inverse(), PoseOnArc(place)), 5.0 * kOneMillimetre) << index;
  }
  EXPECT_EQ(finished[0].snapshot, snapshots_.back());
  EXPECT_EQ(snapshots_.back()->frame_index, 9);
  EXPECT_FALSE(snapshots_.back()->T_map_camera);
  EXPECT_LE(finished[0].keyframes.size(), 5U);
}

// A run that is killed leaves the map as it last was kept, which is a whole map.
TEST_F(MapperTest, SavesMapWheneverItHasGrown) {
  Begin();
  Walk(8);
  EXPECT_TRUE(kept_.empty());
  for (int i = 17; i <= 22; ++i) {
    mapper_->Process(Seen(i, 0.5 * i, i % 2 == 0));
  }
  ASSERT_EQ(kept_.size(), 1U);
  Mapper other(world_.camera, options_, nullptr,
               {[this](AtlasViewPtr atlas) { atlas_ = std::move(atlas); }, {}, {}}, times_);
  other.Restore(kept_.front(), "the saved map", std::make_shared<IdSource>());
  EXPECT_GE(View().keyframes.size() + View().removed.size(), 10U);
  EXPECT_LT(CenterDistance(View().PoseOf(5).T_camera_map, PoseOnArc(5.0)), 10.0 * kOneMillimetre);
}

// The poses of its frames make a long run's map large, also where it stays at one place.
TEST_F(MapperTest, SavesMapOfLongRunLessOften) {
  constexpr int kFrames = 60000;  // half an hour of a camera
  Begin();
  Walk(4);
  TrackingReport frame = Seen(9, 4.5, false);
  for (int i = 9; i < kFrames; ++i) {
    TrackingReport next = Report(i);
    next.pose = frame.pose;
    mapper_->Process(std::move(next));
  }
  std::vector<int> times;  // keyframes when it was kept
  for (int i = 0; i < 45; ++i) {
    const std::size_t before = kept_.size();
    mapper_->Process(Seen(kFrames + i, 4.5 + 0.02 * i, true));
    if (kept_.size() > before) {
      times.push_back(i);
    }
  }
  ASSERT_GE(times.size(), 2U);
  EXPECT_GT(kept_[0].size(), 5'000'000U);
  EXPECT_GE(times[1] - times[0], 25) << "not each ten keyframes";
}

TEST_F(MapperTest, RemovesRedundantKeyframesButKeepsTheirPoses) {
  options_.mapping.culling = CullingOptions();
  Restart();
  Begin();
  Walk(5);
  EXPECT_EQ(View().keyframes.size(), 3U);
  ASSERT_EQ(View().removed.size(), 3U);
  for (const auto& [id, removed] : View().removed) {
    EXPECT_LT(CenterDistance(View().PoseOf(id).T_camera_map, PoseOnArc(static_cast<double>(id))),
              10.0 * kOneMillimetre);
  }
  EXPECT_EQ(mapper_->Finish().at(0).trajectory.size(), 10U) << "their frames stay";
}

TEST_F(MapperTest, NumbersSnapshots) {
  Begin();
  Walk(4);
  mapper_->Finish();
  for (std::size_t i = 0; i < snapshots_.size(); ++i) {
    EXPECT_EQ(snapshots_[i]->sequence_number, static_cast<std::int64_t>(i));
  }
  EXPECT_GE(snapshots_.size(), 6U);  // two at the beginning, one for each keyframe, one at the end
}

TEST_F(MapperTest, RepeatsTheSameMap) {
  Begin();
  Walk(3);
  const MapSnapshotPtr first = mapper_->Finish().at(0).snapshot;
  Restart();
  Begin();
  Walk(3);
  const MapSnapshotPtr second = mapper_->Finish().at(0).snapshot;
  ASSERT_EQ(first->points.size(), second->points.size());
  for (std::size_t i = 0; i < first->points.size(); ++i) {
    EXPECT_EQ(first->points[i].p_map, second->points[i].p_map);
  }
}

// Frames 20 to 22 came before the map and could not be tracked; they are as soon as there are four keyframes.
TEST_F(MapperTest, TracksEarlyFramesOnceTheMapIsLargeEnough) {
  Begin();
  mapper_->Process(Seen(3, 1.5, false));
  TrackingReport report = Seen(4, 2.0, true);
  report.backlog = Backlog{AsTracked(world_.map, 1), {}};
  report.backlog->next.points.resize(kFirstPoints);
  report.backlog->next.points.resize(world_.points.size(), kNoPoint);
  for (int i = 0; i < 3; ++i) {
    report.backlog->earlier.push_back(NewFrame(world_.See(PoseOnArc(0.4 + 0.2 * i)).features, 20 + i));
  }
  report.backlog->earlier.push_back(NewFrame(world_.See(PoseOnArc(1.1)).features, 3));  // tracked meanwhile
  mapper_->Process(std::move(report));
  EXPECT_EQ(View().keyframes.size(), 3U);
  mapper_->Process(Seen(6, 3.0, true));
  const Trajectory trajectory = mapper_->Finish().at(0).trajectory;
  ASSERT_EQ(trajectory.size(), 8U);  // 0, 1, 3, 4, 6 and the three
  EXPECT_LT(CenterDistance(trajectory[2].T_map_camera.Inverse(), PoseOnArc(1.5)), 5.0 * kOneMillimetre);
  for (int i = 0; i < 3; ++i) {
    const TimedPose& pose = trajectory[static_cast<std::size_t>(5 + i)];
    EXPECT_NEAR(pose.timestamp, (20 + i) / 30.0, 1e-9);
    EXPECT_LT(CenterDistance(pose.T_map_camera.Inverse(), PoseOnArc(0.4 + 0.2 * i)), 5.0 * kOneMillimetre);
  }
}

// Points that a keyframe has made are on trial: tracking expects them in twelve frames and finds them in
// none.
TEST_F(MapperTest, RemovesNewPointsThatTrackingNeverFinds) {
  Begin();
  Walk(2);
  std::vector<PointId> young;
  for (const PointId point : View().keyframes.at(2).points) {
    if (point >= static_cast<PointId>(kFirstPoints)) {
      young.push_back(point);
    }
  }
  ASSERT_GT(young.size(), 90U);
  for (int i = 0; i < 12; ++i) {
    TrackingReport report = Seen(5 + i, 2.5, false);
    std::erase_if(report.seen.found, [&](PointId point) { return point >= young.front(); });
    mapper_->Process(std::move(report));
  }
  mapper_->Process(Seen(17, 3.0, true));
  for (const PointId point : young) {
    EXPECT_FALSE(View().Has(point));
  }
  EXPECT_TRUE(View().Has(0));
}

TEST_F(MapperTest, KeepsSubmapsApartAndDropsSmallOnes) {
  options_.mapping.completion.max_frames = 0;
  Restart();
  Begin(0);
  Walk(5);
  mapper_->Process(Beginning(
      1, MakeRingMap({.keyframes = 2, .scale_drift = 0.0, .rotation_drift = 0.0, .first_id = 100}).map));
  EXPECT_EQ(atlas_->submaps.size(), 2U);
  RingMapOptions far = ExactRing();
  far.first_id = 200;
  far.keyframes = 8;
  mapper_->Process(Beginning(2, MakeRingMap(far).map));
  const std::vector<FinishedMap> finished = mapper_->Finish();
  ASSERT_EQ(finished.size(), 2U);
  EXPECT_EQ(finished[0].trajectory.size(), 10U) << "the one with the most frames comes first";
  EXPECT_EQ(finished[1].trajectory.size(), 8U);
  EXPECT_EQ(mapper_->Counters().resets, 1);
  EXPECT_EQ(mapper_->Counters().merges, 0) << "without words";
}

// Frames that tracking has lost are found at the end; what they show anew becomes a part of the map.
TEST_F(MapperTest, PlacesLeftoverFrames) {
  Begin();
  Walk(5);
  for (int i = 0; i < 3; ++i) {
    TrackingReport lost = Report(11 + i);
    lost.features = world_.See(PoseOnArc(5.5 + 0.5 * i), {.pixel_noise = 0.2}).features;
    mapper_->Process(std::move(lost));
  }
  TrackingReport elsewhere = Report(14);
  elsewhere.features = MakeSyntheticMap({.seed = 99}).See(PoseOnArc(3.0)).features;
  mapper_->Process(std::move(elsewhere));
  const std::vector<FinishedMap> finished = mapper_->Finish();
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_EQ(mapper_->Counters().placed_at_end, 3);
  const Trajectory& trajectory = finished[0].trajectory;
  ASSERT_EQ(trajectory.size(), 13U);  // 0, 1, 3 to 10 and the three
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(CenterDistance(trajectory[static_cast<std::size_t>(10 + i)].T_map_camera.Inverse(),
                             PoseOnArc(5.5 + 0.5 * i)),
              10.0 * kOneMillimetre);
  }
}

// A frame of the map, and one of elsewhere. `stop` is asked before each attempt.
TEST_F(MapperTest, DoesNotRetryFramesInUnchangedMap) {
  for (const bool stop : {false, true}) {
    Restart();
    Begin();
    Walk(5);
    TrackingReport lost = Report(11);
    lost.features = world_.See(PoseOnArc(5.5), {.pixel_noise = 0.2}).features;
    mapper_->Process(std::move(lost));
    TrackingReport elsewhere = Report(14);
    elsewhere.features = MakeSyntheticMap({.seed = 99}).See(PoseOnArc(3.0)).features;
    mapper_->Process(std::move(elsewhere));
    int asked = 0;
    const auto count = [&] {
      ++asked;
      return stop;
    };
    EXPECT_EQ(mapper_->Finish(count).at(0).trajectory.size(), stop ? 10U : 11U);
    EXPECT_EQ(mapper_->Counters().placed_at_end, stop ? 0 : 1);
    EXPECT_GT(asked, 0);
    EXPECT_LT(asked, 20) << "the other frame is not tried again and again";
  }
}

TEST_F(MapperTest, PlacesNoFramesWhenCompletionIsOff) {
  options_.mapping.completion.max_frames = 0;
  Restart();
  Begin();
  Walk(5);
  TrackingReport lost = Report(11);
  lost.features = world_.See(PoseOnArc(5.5)).features;
  mapper_->Process(std::move(lost));
  EXPECT_EQ(mapper_->Finish().at(0).trajectory.size(), 10U);
  EXPECT_EQ(mapper_->Counters().placed_at_end, 0);
}

// Without words and in a unit of its own.
TEST_F(MapperTest, TiesSubmapsAtTheEnd) {
  mapper_->Process(Beginning(0, MakeRingMap(ExactRing()).map));
  RingMapOptions later = ExactRing();
  later.first_id = 100;
  later.keyframes = 8;
  Map map = MakeRingMap(later).map;
  map.Renumber({.frame = 100, .time = 10.0});
  map.Transform(
      {2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitZ())), {3.0, -1.0, 7.0}});
  mapper_->Process(Beginning(1, std::move(map)));
  EXPECT_EQ(mapper_->Counters().merges, 0);
  ASSERT_EQ(mapper_->Finish().size(), 1U);
  EXPECT_EQ(mapper_->Counters().tied_at_end, 1);
}

}  // namespace
}  // namespace sqslam
