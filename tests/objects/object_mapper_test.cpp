#include "slam/objects/object_mapper.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flat_surface.h"
#include "slam/objects/object_tracker.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/util/statistics.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::FlatSurface;
using testing::SyntheticDesk;

// Tracking and mapping of the objects on a synthetic desk, in an upright map.
struct DeskRun {
  explicit DeskRun(const SyntheticDesk& desk_in, const ObjectOptions& options = {})
      : desk(desk_in), tracker(options), mapper(options, 1) {
    mapper.SetUpright(true, FlatSurface(0.0));
  }
  void Observe(const ObjectFrame& frame) { mapper.AddObservations(tracker.Track(frame, *mapper.View())); }
  void ObserveFrames(int end) {
    for (int i = 0; i < end; ++i) {
      Observe(desk.Frame(i));
    }
  }

  const SyntheticDesk& desk;
  ObjectTracker tracker;
  ObjectMapper mapper;
  const PointLookup lookup = [this](std::int64_t& id) { return desk.Position(id); };
};

TEST(ObjectMapper, EstimatesOutdatedObjectsAFewAtATime) {
  const SyntheticDesk desk(5);
  ObjectOptions options;
  options.max_estimates = 2;
  DeskRun run(desk, options);
  ObjectMapper& mapper = run.mapper;
  run.ObserveFrames(SyntheticDesk::kFrames);
  mapper.UpdateAll(run.lookup, desk.Camera());
  // The map moves: what is estimated anew follows its points.
  const auto moved = [&](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    const auto p = desk.Position(id);
    return p ? std::optional<Eigen::Vector3d>(*p + Eigen::Vector3d(0.0, 0.0, 0.01)) : std::nullopt;
  };
  const auto changed = [&](const std::vector<SnapshotObject>& before) {
    const std::vector<SnapshotObject> after = mapper.Objects();
    return std::ranges::count_if(after, [&](const SnapshotObject& object) {
      const auto old = std::ranges::find(before, object.id, &SnapshotObject::id);
      return old != before.end() &&
             old->superquadric.T_map_object.translation != object.superquadric.T_map_object.translation;
    });
  };
  const std::vector<SnapshotObject> before = mapper.Objects();
  ASSERT_GE(before.size(), 6u);
  mapper.Update(moved, desk.Camera());
  EXPECT_EQ(changed(before), 0);  // nothing is outdated
  mapper.Outdate();
  mapper.Update(moved, desk.Camera());
  EXPECT_EQ(changed(before), 2);
  for (std::size_t i = 0; i < before.size(); ++i) {
    mapper.Update(moved, desk.Camera());
  }
  EXPECT_EQ(changed(before), static_cast<std::ptrdiff_t>(before.size()));
}

// A thing seen too rarely to be shown is deleted when it stays away, and its id is never used again.
TEST(ObjectMapper, DeletesObjectsSeenOnce) {
  const SyntheticDesk desk(1);
  ObjectOptions options;
  options.forget_after = 20;
  DeskRun desk_run(desk, options);
  ObjectMapper& mapper = desk_run.mapper;
  const auto run = [&](int begin, int end, bool with_false_box) {
    for (int i = begin; i < end; ++i) {
      ObjectFrame frame = desk.Frame(i);
      if (with_false_box) {
        frame.detections.push_back({"kite", 0.5, {20.0, 200.0, 80.0, 80.0}});
      }
      desk_run.Observe(frame);
    }
    mapper.Update(desk_run.lookup, desk.Camera());
  };
  const auto kites = [&] {
    const auto& landmarks = mapper.View()->landmarks;
    return std::count_if(landmarks.begin(), landmarks.end(), [](const auto& l) { return l.label == "kite"; });
  };
  run(0, 3, true);
  EXPECT_EQ(kites(), 1);
  const int next_id = desk_run.tracker.NextId();
  run(3, 40, false);
  EXPECT_EQ(kites(), 0);
  EXPECT_FALSE(mapper.View()->deleted.empty());
  EXPECT_GE(desk_run.tracker.NextId(), next_id);
}

// Boxes that were associated with nothing when they were seen, as in views far apart.
TEST(ObjectMapper, AssociatesLeftBoxesAtTheEnd) {
  const SyntheticDesk desk(5);
  DeskRun run(desk);
  int boxes = 0;
  for (int i = 0; i < SyntheticDesk::kFrames; i += 4) {
    std::vector<ObjectObservation> seen = run.tracker.Track(desk.Frame(i), *run.mapper.View());
    for (ObjectObservation& observation : seen) {
      observation.object_id = -1;
    }
    boxes += static_cast<int>(seen.size());
    run.mapper.AddObservations(seen);
  }
  run.mapper.UpdateAll(run.lookup, desk.Camera());
  int used = 0;
  for (const SnapshotObject& object : run.mapper.Objects()) {
    used += object.observations;
  }
  EXPECT_GE(run.mapper.Objects().size(), desk.Objects().size() - 2);
  EXPECT_GT(used, 0.7 * boxes);
}

TEST(ObjectMapper, EstimatesNoMoreObjectsAtAKeyframeThanAllowed) {
  const SyntheticDesk desk(1);
  const auto estimated_after = [&](int max_estimates, int updates) {
    ObjectOptions options;
    options.max_estimates = max_estimates;
    DeskRun run(desk, options);
    run.ObserveFrames(20);
    for (int i = 0; i < updates; ++i) {
      run.mapper.Update(run.lookup, desk.Camera());
    }
    const auto& landmarks = run.mapper.View()->landmarks;
    return std::count_if(landmarks.begin(), landmarks.end(), [](const auto& l) { return l.estimated; });
  };
  const auto all = estimated_after(0, 1);
  EXPECT_GT(all, 4);
  EXPECT_EQ(estimated_after(2, 1), 2);
  EXPECT_EQ(estimated_after(2, 2), 4);
  EXPECT_EQ(estimated_after(2, 10), all);
}

TEST(ObjectMapper, FollowsFusedPointsAndDropsCulledOnes) {
  const SyntheticDesk desk(1);
  DeskRun run(desk);
  ObjectMapper& mapper = run.mapper;
  run.ObserveFrames(30);
  const PointLookup lookup = [&](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    if (id % 4 == 3) {
      return std::nullopt;
    }
    id -= id % 2;  // odd points were fused with the one before
    return desk.Position(id);
  };
  mapper.UpdateAll(lookup, desk.Camera());
  ASSERT_FALSE(mapper.Objects().empty());
  for (const auto& [point, object] : mapper.PointObjects()) {
    EXPECT_EQ(point % 2, 0);
  }
}

TEST(ObjectMapper, PublishesOnlyReliableObjects) {
  const SyntheticDesk desk(1);
  const auto objects = [&](double min_reliability) {
    ObjectOptions options;
    options.min_reliability = min_reliability;
    DeskRun run(desk, options);
    run.ObserveFrames(30);
    run.mapper.UpdateAll(run.lookup, desk.Camera());
    return run.mapper.Objects();
  };
  const std::vector<SnapshotObject> all = objects(0.0);
  std::vector<double> reliabilities;
  for (const SnapshotObject& object : all) {
    reliabilities.push_back(object.fit.reliability);
  }
  ASSERT_GE(all.size(), 4U);
  const double middle = UpperMedian(reliabilities);
  const auto expected = std::ranges::count_if(reliabilities, [&](double r) { return r >= middle; });
  ASSERT_LT(expected, static_cast<int>(all.size()));
  EXPECT_EQ(static_cast<int>(objects(middle).size()), expected);
}

TEST(ObjectMapper, KeepsHiddenObjectsHiddenWhenContinued) {
  const SyntheticDesk desk(1);
  ObjectOptions options;
  DeskRun all(desk, options);
  all.ObserveFrames(30);
  all.mapper.UpdateAll(all.lookup, desk.Camera());
  std::vector<double> reliabilities;
  for (const SnapshotObject& object : all.mapper.Objects()) {
    reliabilities.push_back(object.fit.reliability);
  }
  options.min_reliability = UpperMedian(reliabilities);
  DeskRun run(desk, options);
  run.ObserveFrames(30);
  run.mapper.UpdateAll(run.lookup, desk.Camera());
  ByteWriter writer;
  run.mapper.Save(writer);
  ByteReader reader(writer.Bytes(), "the map");
  ObjectMapper continued(options, 1);
  continued.Load(reader);
  ASSERT_LT(run.mapper.Objects().size(), reliabilities.size());
  EXPECT_EQ(continued.Objects().size(), run.mapper.Objects().size());
}

// An object that an earlier run has shown keeps its id in the next, also where that one would not show it.
TEST(ObjectMapper, KeepsObjectsOfAnEarlierRun) {
  const SyntheticDesk desk(1);
  DeskRun run(desk);
  ObjectMapper& first = run.mapper;
  run.ObserveFrames(30);
  first.UpdateAll(run.lookup, desk.Camera());
  ByteWriter writer;
  first.Save(writer);
  ByteReader reader(writer.Bytes(), "the map");
  ObjectMapper second(ObjectOptions(), 1);
  second.Load(reader);
  ASSERT_FALSE(first.Objects().empty());
  const int id = first.Objects().front().id;
  // Far later and elsewhere: all else that is not shown would be forgotten.
  ObjectObservation later;
  later.object_id = 1000;
  later.frame_index = 100000;
  later.T_map_camera = desk.Frame(0).T_map_camera;
  later.detection = desk.Frame(0).detections.front();
  second.AddObservations({&later, 1});
  const PointLookup gone = [](std::int64_t&) -> std::optional<Eigen::Vector3d> { return std::nullopt; };
  second.UpdateAll(gone, desk.Camera());
  std::vector<int> ids;
  for (const ObjectLandmarkView& landmark : second.View()->landmarks) {
    ids.push_back(landmark.id);
  }
  EXPECT_NE(std::ranges::find(ids, id), ids.end());
}

}  // namespace
}  // namespace sqslam
