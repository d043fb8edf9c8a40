#include "slam/tracking/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "tests/support/synthetic_map.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::AlignedError;
using testing::HandHeldPath;
using testing::TexturedWorld;
using testing::ThroughLens;

constexpr int kFrames = 90;

// Rendered once for all tests.
const std::vector<Frame>& Frames() {
  static const std::vector<Frame> frames = [] {
    const TexturedWorld world;
    std::vector<Frame> rendered;
    for (const Rigid3d& T_map_camera : HandHeldPath(kFrames)) {
      rendered.push_back(world.Render(static_cast<std::int64_t>(rendered.size()), T_map_camera));
    }
    return rendered;
  }();
  return frames;
}

Frame BlankFrame(std::int64_t index) {
  Frame frame = Frames()[0];
  frame.index = index;
  frame.timestamp = static_cast<double>(index) / 30.0;
  frame.gray = cv::Mat(frame.gray.size(), frame.gray.type(), cv::Scalar(90));
  frame.bgr = cv::Mat(frame.bgr.size(), frame.bgr.type(), cv::Scalar::all(90));
  return frame;
}

// A place with a geometry of its own: the mirror image of the world.
Frame MirrorFrame(int index) {
  Frame frame = Frames().at(static_cast<std::size_t>(index));
  cv::flip(Frames()[static_cast<std::size_t>(index)].gray, frame.gray, 1);
  cv::flip(Frames()[static_cast<std::size_t>(index)].bgr, frame.bgr, 1);
  return frame;
}

// The test stands in for the mapping thread: it keeps the maps that tracking begins and publishes them.
class TrackerTest : public ::testing::Test {
 protected:
  explicit TrackerTest(TrackingOptions options = {}) : tracker_(MakeTracker(options, world_.GetCamera())) {}
  TrackerTest(TrackingOptions options, const Camera& camera) : tracker_(MakeTracker(options, camera)) {}

  Tracker MakeTracker(TrackingOptions options, const Camera& camera) {
    options.features.num_features = 500;
    return {camera, options, ObjectOptions(), std::make_shared<IdSource>(), nullptr, times_};
  }

  TrackingReport Track(const Frame& frame) {
    TrackingReport report = tracker_.Track(frame, atlas_, pending_);
    if (report.initial_map) {
      begun_ = report.submap;
      maps_[report.submap] = std::move(report.initial_map);
      origins_[report.submap] = {report.submap, {}};
      Publish();
    }
    return report;
  }
  TrackingReport Track(int index) { return Track(Frames().at(static_cast<std::size_t>(index))); }
  // Tracks from the first frame until a map has begun. Returns the index of the next frame.
  int Begin() {
    int index = 0;
    while (begun_ < 0 && index < kFrames) {
      Track(index++);
    }
    EXPECT_EQ(begun_, 0);
    return index;
  }

  void Publish() {
    AtlasView atlas;
    for (const auto& [number, map] : maps_) {
      TrackingView view = MakeTrackingView(*map);
      view.submap = number;
      view.objects = std::make_shared<const ObjectMapView>();
      atlas.submaps[number] = std::make_shared<const TrackingView>(std::move(view));
    }
    atlas.origins = origins_;
    atlas_ = std::make_shared<const AtlasView>(std::move(atlas));
  }
  Rigid3d PoseOf(const TrackingReport& report) const {
    return Resolve(*report.pose, maps_.at(report.submap)->PoseOf(report.pose->reference)).T_camera_map;
  }

  TexturedWorld world_;
  StageTimes times_;
  Tracker tracker_;
  std::map<std::int64_t, std::unique_ptr<Map>> maps_;
  std::map<std::int64_t, AtlasView::Origin> origins_;
  std::int64_t begun_ = -1;  // the newest submap
  AtlasViewPtr atlas_;
  int pending_ = 0;
};

TEST_F(TrackerTest, BeginsOneMapAndTracksInIt) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  const std::vector<Rigid3d> path = HandHeldPath(kFrames);
  for (int i = 0; i < kFrames; ++i) {
    const bool had_map = begun_ >= 0;
    const TrackingReport report = Track(i);
    EXPECT_EQ(report.frame_index, i);
    EXPECT_EQ(report.pose.has_value(), begun_ >= 0) << i;
    EXPECT_EQ(tracker_.Initialized(), begun_ >= 0);
    EXPECT_EQ(tracker_.Newest().T_map_camera.has_value(), begun_ >= 0);
    EXPECT_EQ(report.backlog.has_value(), begun_ >= 0 && !had_map) << "the frames before are shared once";
    if (report.pose) {
      estimate.push_back(PoseOf(report).Inverse().translation);
      truth.push_back(path[static_cast<std::size_t>(i)].translation);
      EXPECT_EQ(report.submap, 0);
    }
    if (report.backlog) {
      EXPECT_EQ(report.backlog->earlier.size(), static_cast<std::size_t>(i));
    }
  }
  ASSERT_GT(estimate.size(), 30U);
  EXPECT_LT(AlignedError(estimate, truth), 0.015);  // against two keyframes that are never refined
  EXPECT_FALSE(tracker_.Lost());
  EXPECT_EQ(tracker_.Counters().losses, 0);
}

// The world's camera behind a fisheye lens of 70 degrees.
Camera FisheyeLens() {
  return {320, 240, 260.0, 260.0, 160.0, 120.0, {0.25, -0.1, 0.0, 0.0}, 30.0, 0.0, LensModel::kFisheye};
}

class FisheyeTrackerTest : public TrackerTest {
 protected:
  FisheyeTrackerTest() : TrackerTest({}, FisheyeLens()) {}
};

TEST_F(FisheyeTrackerTest, TracksAsWellAsWithoutDistortion) {
  const ThroughLens through_lens(FisheyeLens(), TexturedWorld().GetCamera());
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  const std::vector<Rigid3d> path = HandHeldPath(kFrames);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (const TrackingReport report = Track(through_lens(Frames()[i])); report.pose) {
      estimate.push_back(PoseOf(report).Inverse().translation);
      truth.push_back(path[i].translation);
    }
  }
  ASSERT_GT(estimate.size(), 30U);
  EXPECT_LT(AlignedError(estimate, truth), 0.015);
}

TEST_F(TrackerTest, ReportsLossAndRelocalizes) {
  const int next = Begin();
  Track(next);
  for (int i = next + 1; i < next + 4; ++i) {
    const TrackingReport report = Track(BlankFrame(i));
    EXPECT_FALSE(report.pose);
    EXPECT_FALSE(report.keyframe);
    EXPECT_TRUE(report.matches.empty());
    EXPECT_TRUE(report.seen.found.empty());
    EXPECT_TRUE(tracker_.Lost());
    EXPECT_FALSE(tracker_.Newest().T_map_camera);
  }
  const TrackingReport found = Track(next + 4);
  ASSERT_TRUE(found.pose);
  EXPECT_FALSE(tracker_.Lost());
  EXPECT_EQ(tracker_.Counters().losses, 1);
  EXPECT_EQ(tracker_.Counters().relocalizations, 1);
  ASSERT_TRUE(found.backlog);
  EXPECT_EQ(found.backlog->earlier.size(), 3U);
  EXPECT_EQ(found.backlog->next.index, next + 4);
}

// Whatever comes: one flat image, noise, an image that is nearly too small, frames that go back in time.
TEST_F(TrackerTest, DoesNotThrowOnRandomImages) {
  cv::RNG random(5);
  const auto trouble = [&](std::int64_t index) {
    Frame noise = BlankFrame(index);
    random.fill(noise.gray, cv::RNG::UNIFORM, 0, 255);
    Frame small = BlankFrame(index + 1);
    small.gray = cv::Mat(40, 40, CV_8U, cv::Scalar(10));
    small.bgr = cv::Mat(40, 40, CV_8UC3, cv::Scalar::all(10));
    for (const Frame& frame : {BlankFrame(index), noise, small, BlankFrame(0), BlankFrame(index)}) {
      const TrackingReport report = Track(frame);
      EXPECT_FALSE(report.pose);
    }
  };
  ASSERT_NO_THROW(trouble(0));
  EXPECT_FALSE(tracker_.Initialized());
  EXPECT_FALSE(tracker_.NoMapReason().empty());
  const int next = Begin();
  ASSERT_NO_THROW(trouble(next));
  EXPECT_TRUE(tracker_.Lost());
  maps_.at(0)->RemoveKeyframe(maps_.at(0)->NewestKeyframe());
  Publish();
  ASSERT_NO_THROW(trouble(next + 5));
  EXPECT_TRUE(tracker_.Lost());
}

class RegularKeyframesTest : public TrackerTest {
 protected:
  RegularKeyframesTest() : TrackerTest(Regular()) {}
  static TrackingOptions Regular() {
    TrackingOptions options;
    options.keyframes.max_interval = 4.5 / 30.0;
    options.keyframes.min_points = 0;
    options.keyframes.tracked_share = 0.0;  // an interval that has passed is the only reason
    options.keyframes.urgent_share = 0.0;
    return options;
  }
};

TEST_F(RegularKeyframesTest, MakesKeyframeAfterTheInterval) {
  const int begin = Begin();  // the frame before this one is a keyframe
  for (int i = begin; i < begin + 12; ++i) {
    const TrackingReport report = Track(i);
    EXPECT_EQ(report.keyframe.has_value(), (i - begin + 1) % 5 == 0) << i - begin;
    if (report.keyframe) {
      EXPECT_EQ(report.keyframe->points.size(), report.keyframe->features->Size());
    }
  }
}

TEST_F(RegularKeyframesTest, WaitsWhileMappingIsBusy) {
  const int begin = Begin();
  pending_ = 1;
  for (int i = begin; i < begin + 8; ++i) {
    EXPECT_FALSE(Track(i).keyframe);
  }
  pending_ = 0;
  EXPECT_TRUE(Track(begin + 8).keyframe);
}

class SparseKeyframesTest : public TrackerTest {
 protected:
  SparseKeyframesTest() : TrackerTest(Sparse()) {}
  static TrackingOptions Sparse() {
    TrackingOptions options;
    options.keyframes.tracked_share = 0.0;
    options.keyframes.min_points = 10000;  // more than any frame tracks
    return options;
  }
};

TEST_F(SparseKeyframesTest, MakesKeyframesWhileFewPointsAreTracked) {
  const int begin = Begin();  // the frame before this one is a keyframe
  for (int i = begin; i < begin + 6; ++i) {
    EXPECT_EQ(Track(i).keyframe.has_value(), (i - begin) % 2 == 1) << "every second frame";
  }
}

class UrgentKeyframesTest : public TrackerTest {
 protected:
  UrgentKeyframesTest() : TrackerTest(Urgent()) {}
  static TrackingOptions Urgent() {
    TrackingOptions options;
    options.keyframes.tracked_share = 1.0;
    options.keyframes.urgent_share = 1.0;
    return options;
  }
};

TEST_F(UrgentKeyframesTest, MakesKeyframeUnlessMappingLagsFarBehind) {
  const int begin = Begin();
  pending_ = 3;
  EXPECT_FALSE(Track(begin).keyframe);
  EXPECT_FALSE(Track(begin + 1).keyframe);
  pending_ = 2;
  EXPECT_TRUE(Track(begin + 2).keyframe);
  EXPECT_FALSE(Track(begin + 3).keyframe) << "two frames in a row";
}

TEST_F(TrackerTest, FollowsMovedMap) {
  const int next = Begin();
  const Sim3d S_new_old{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, 7.0}};
  Track(next);
  const TrackingReport before = Track(next + 1);
  ASSERT_TRUE(before.pose);
  const Rigid3d T_camera_old = PoseOf(before);
  maps_.at(0)->Transform(S_new_old);
  origins_[0].S_map_origin = S_new_old;
  Publish();
  Frame again = Frames()[static_cast<std::size_t>(next) + 1];  // the same image, one frame later
  again.index += 1;
  again.timestamp += 1.0 / 30.0;
  const TrackingReport after = Track(again);
  ASSERT_TRUE(after.pose);
  EXPECT_EQ(after.S_map_origin, S_new_old);
  EXPECT_LT(testing::CenterDistance(PoseOf(after), MoveCamera(T_camera_old, S_new_old)), 2.5e-3);
  EXPECT_NEAR(static_cast<double>(after.matches.size()), static_cast<double>(before.matches.size()), 5.0);
  EXPECT_EQ(tracker_.Counters().losses, 0);
}

class TrackerSubmapsTest : public TrackerTest {
 protected:
  TrackerSubmapsTest() : TrackerTest(Impatient()) {}
  static TrackingOptions Impatient() {
    TrackingOptions options;
    options.submap_after = 2;
    return options;
  }
  // Tracks mirrored frames from `index` on until a second submap has begun. Returns the next index.
  int BeginElsewhere(int index) {
    while (begun_ < 1 && index < kFrames) {
      Track(MirrorFrame(index++));
    }
    EXPECT_EQ(begun_, 1);
    return index;
  }
};

TEST_F(TrackerSubmapsTest, BeginsSubmapWhenRelocalizationFails) {
  const int next = BeginElsewhere(Begin());
  EXPECT_FALSE(tracker_.Lost());
  EXPECT_EQ(tracker_.Counters().losses, 1);
  EXPECT_EQ(tracker_.Counters().relocalizations, 0);
  const TrackingReport report = Track(MirrorFrame(next));
  EXPECT_TRUE(report.pose);
  EXPECT_EQ(report.submap, 1);
  EXPECT_GT(maps_.at(1)->OldestKeyframe(), maps_.at(0)->NewestKeyframe()) << "ids are shared";
}

TEST_F(TrackerSubmapsTest, FollowsMergeIntoOtherSubmap) {
  const int next = BeginElsewhere(Begin());
  const Sim3d S_0_1{
      0.5, Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY())), {9.0, 0.0, 0.0}};
  const Rigid3d T_camera_1 = PoseOf(Track(MirrorFrame(next)));
  maps_.at(1)->Transform(S_0_1);
  maps_.at(0)->Absorb(std::move(*maps_.at(1)));
  maps_.erase(1);
  origins_[1] = {0, S_0_1};
  Publish();
  const TrackingReport report = Track(MirrorFrame(next + 1));
  EXPECT_EQ(report.submap, 0);
  ASSERT_TRUE(report.pose);
  EXPECT_LT(testing::CenterDistance(PoseOf(report), MoveCamera(T_camera_1, S_0_1)), 0.02);
}

TEST_F(TrackerTest, AssignsLateBoxesToTheirFrame) {
  const int next = Begin();
  for (int i = next; i < next + 3; ++i) {
    Frame frame = Frames()[static_cast<std::size_t>(i)];
    frame.detections_follow = true;
    EXPECT_FALSE(Track(frame).objects);
  }
  const std::vector<Detection> boxes{{"book", 0.9, {60.0, 40.0, 200.0, 160.0}}};
  const std::optional<SeenObjects> seen = tracker_.AddDetections(next + 1, boxes);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->frame_index, next + 1);
  EXPECT_EQ(seen->detections.size(), 1U);
  EXPECT_EQ(seen->observations.size(), 1U);
  EXPECT_FALSE(tracker_.AddDetections(next, boxes)) << "frames come in order";
  EXPECT_TRUE(tracker_.AddDetections(next + 2, boxes));
  EXPECT_FALSE(tracker_.AddDetections(next + 2, boxes)) << "each of them once";
  Frame frame = Frames()[static_cast<std::size_t>(next) + 3];
  frame.detections = boxes;
  EXPECT_EQ(Track(frame).objects->observations.size(), 1U) << "without waiting";
}

}  // namespace
}  // namespace sqslam
