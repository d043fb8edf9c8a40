#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "slam/localizer.h"
#include "slam/mapping/mapper.h"
#include "slam/system.h"
#include "slam/system_parts.h"
#include "slam/util/error.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

using testing::AlignedError;
using testing::HandHeldPath;
using testing::TexturedWorld;

constexpr int kMapped = 70;  // frames of the first run; the others come after it
constexpr int kFrames = 110;

SystemOptions KeptOptions() {
  SystemOptions options;
  options.objects.min_reliability = 0.0;  // the run is short
  options.deterministic = true;
  options.tracking.features.num_features = 600;
  return options;
}

// A box around the second panel, as a detector sees it.
Detection BoxOfPanel(const TexturedWorld& world, const Rigid3d& T_map_camera) {
  Box2d box;
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Eigen::Vector3d& corner : world.PanelCorners(2)) {
    const Eigen::Vector2d pixel = world.GetCamera().Project(T_map_camera.Inverse() * corner);
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  low = low.cwiseMax(Eigen::Vector2d::Zero());
  high = high.cwiseMin(Eigen::Vector2d(world.GetCamera().width - 1, world.GetCamera().height - 1));
  return {"book", 0.9, {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()}};
}

class KeptSystem : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    path_ = HandHeldPath(kFrames);
    System system(world_->GetCamera(), KeptOptions(), [](const MapSnapshotPtr&) {});
    Play(0, kMapped, [&](const Frame& frame) { system.Process(frame); });
    first_ = system.Finish();
    ASSERT_NE(first_.map.snapshot, nullptr) << first_.no_map_reason;
  }
  static void Play(int begin, int end, const std::function<void(const Frame&)>& process) {
    for (int i = begin; i < end; ++i) {
      Frame frame = world_->Render(i, path_[static_cast<std::size_t>(i)]);
      frame.detections.push_back(BoxOfPanel(*world_, path_[static_cast<std::size_t>(i)]));
      process(frame);
    }
  }
  // The pose that the first run gave the frame, in its map.
  static Rigid3d Known(int frame) {
    for (const TimedPose& pose : first_.map.trajectory) {
      if (std::lround(30.0 * pose.timestamp) == frame) {
        return pose.T_map_camera;
      }
    }
    ADD_FAILURE() << "frame " << frame << " was not mapped";
    return {};
  }

  static inline const std::unique_ptr<TexturedWorld> world_ = std::make_unique<TexturedWorld>();
  static inline std::vector<Rigid3d> path_;
  static inline RunResult first_;
};

TEST_F(KeptSystem, RoundTripsByteIdentically) {
  const SystemOptions options = KeptOptions();
  StageTimes times;
  AtlasViewPtr atlas;
  Mapper mapper(first_.kept.camera, OptionsOfMapper(options), LoadVocabulary(options),
                {[&](AtlasViewPtr view) { atlas = std::move(view); }, {}, {}}, times);
  const auto ids = std::make_shared<IdSource>();
  const std::int64_t main = mapper.Restore(first_.kept.state, "the map", ids).submap;
  const std::string again = mapper.Save();
  const auto [a, b] = std::ranges::mismatch(again, first_.kept.state);
  EXPECT_TRUE(a == again.end() && b == first_.kept.state.end())
      << "byte " << a - again.begin() << " of " << again.size() << ", " << first_.kept.state.size();
  const TrackingView& view = *atlas->submaps.at(main);
  EXPECT_EQ(view.keyframes.size(), first_.map.keyframes.size());
  EXPECT_GT(ids->next_point, 0);
  for (const auto& [id, keyframe] : view.keyframes) {
    EXPECT_LT(id, ids->next_keyframe);
    EXPECT_FALSE(keyframe.words->words.empty());
  }
}

TEST_F(KeptSystem, RejectsDamagedStates) {
  for (std::size_t size = 0; size < first_.kept.state.size(); size += first_.kept.state.size() / 23) {
    SavedMap cut = first_.kept;
    cut.state.resize(size);
    EXPECT_THROW(Localizer(cut, "map.sqmap: the map", KeptOptions()), InputError) << size;
  }
}

TEST_F(KeptSystem, RejectsOtherVocabulary) {
  SavedMap other = first_.kept;
  other.vocabulary = "12345678";
  EXPECT_THROW(Localizer(other, "map", KeptOptions()), InputError);
  SystemOptions none = KeptOptions();
  none.vocabulary = "none";
  EXPECT_THROW(Localizer(first_.kept, "map", none), UsageError);
}

// In the old map's own frame: the maps are not aligned. The localizer takes keypoints as detected, while the
// run aligned them by the images.
TEST_F(KeptSystem, LocalizesFrames) {
  constexpr double kMaxError = 0.03;  // of the path
  Localizer localizer(first_.kept, "map", KeptOptions());
  Play(20, kFrames, [&](const Frame& frame) { localizer.Process(frame); });
  const Localization found = localizer.Finish();
  EXPECT_EQ(found.frames, kFrames - 20);
  EXPECT_GE(found.poses.size(), static_cast<std::size_t>(kMapped - 20));
  EXPECT_EQ(found.timing_ms.at("localization.first_pose").count, 1);
  const double unit = (Known(kMapped - 1).translation - Known(20).translation).norm();
  for (int i = 20; i < kMapped; ++i) {
    ASSERT_TRUE(found.poses.contains(i)) << i;
    EXPECT_LT((found.poses.at(i).T_map_camera.translation - Known(i).translation).norm(), kMaxError * unit)
        << i;
  }
}

TEST_F(KeptSystem, ExtendsMapInSecondRun) {
  std::vector<MapSnapshotPtr> snapshots;
  System system(first_.kept, "map", KeptOptions(),
                [&](MapSnapshotPtr snapshot) { snapshots.push_back(std::move(snapshot)); });
  Play(40, kFrames, [&](const Frame& frame) { system.Process(frame); });
  const RunResult second = system.Finish();
  ASSERT_NE(second.map.snapshot, nullptr);
  EXPECT_TRUE(second.others.empty());
  EXPECT_EQ(second.frames, kFrames - 40);
  EXPECT_GE(second.tracked, 50);
  EXPECT_EQ(second.map.trajectory.size(), first_.map.trajectory.size() + second.tracked);
  EXPECT_GT(second.map.keyframes.size(), first_.map.keyframes.size());
  for (std::size_t i = 1; i < second.map.trajectory.size(); ++i) {
    EXPECT_GT(second.map.trajectory[i].timestamp, second.map.trajectory[i - 1].timestamp);
  }
  EXPECT_FALSE(snapshots.empty());
  ASSERT_FALSE(first_.map.snapshot->objects.empty());
  ASSERT_EQ(second.map.snapshot->objects.size(), first_.map.snapshot->objects.size());
  for (std::size_t i = 0; i < first_.map.snapshot->objects.size(); ++i) {
    const SnapshotObject& before = first_.map.snapshot->objects[i];
    const SnapshotObject& after = second.map.snapshot->objects[i];
    EXPECT_EQ(after.id, before.id);
    EXPECT_EQ(after.label, before.label);
    EXPECT_GT(after.observations, before.observations);
  }
}

// Two runs that know nothing of each other, each with a scale and frame of its own.
TEST_F(KeptSystem, MergesMapsOfTwoRuns) {
  System other(world_->GetCamera(), KeptOptions(), [](const MapSnapshotPtr&) {});
  Play(45, kFrames, [&](const Frame& frame) { other.Process(frame); });
  const RunResult second = other.Finish();
  ASSERT_NE(second.map.snapshot, nullptr);
  const RunResult both = MergeMaps(first_.kept, "first", second.kept, "second", KeptOptions());
  EXPECT_TRUE(both.others.empty());
  EXPECT_EQ(both.counters.merges, 1);
  EXPECT_EQ(both.map.trajectory.size(), first_.map.trajectory.size() + second.map.trajectory.size());
  EXPECT_EQ(both.map.snapshot->objects.size(), first_.map.snapshot->objects.size())
      << "one thing is one object";
  EXPECT_EQ(both.map.snapshot->objects.front().id, first_.map.snapshot->objects.front().id);
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  const double shift =
      both.map.trajectory[first_.map.trajectory.size()].timestamp - second.map.trajectory.front().timestamp;
  for (std::size_t i = 0; i < both.map.trajectory.size(); ++i) {
    const TimedPose& pose = both.map.trajectory[i];
    const double time = pose.timestamp - (i < first_.map.trajectory.size() ? 0.0 : shift);
    estimate.push_back(pose.T_map_camera.translation);
    truth.push_back(path_[static_cast<std::size_t>(std::lround(30.0 * time))].translation);
  }
  EXPECT_LT(AlignedError(estimate, truth), 0.02);
  // The result is a map to go on with.
  Localizer localizer(both.kept, "both", KeptOptions());
  Play(60, 70, [&](const Frame& frame) { localizer.Process(frame); });
  EXPECT_EQ(localizer.Finish().poses.size(), 10U);
}

TEST_F(KeptSystem, KeepsMapsOfDifferentPlacesApart) {
  System other(world_->GetCamera(), KeptOptions(), [](const MapSnapshotPtr&) {});
  Play(0, kMapped, [&](Frame frame) {
    cv::flip(frame.gray, frame.gray, 0);  // a place that looks different to every descriptor
    cv::flip(frame.bgr, frame.bgr, 0);
    frame.detections.clear();
    other.Process(frame);
  });
  const RunResult second = other.Finish();
  ASSERT_NE(second.map.snapshot, nullptr) << second.no_map_reason;
  EXPECT_THROW(MergeMaps(first_.kept, "first", second.kept, "second", KeptOptions()), NoMapError);
}

}  // namespace
}  // namespace sqslam
