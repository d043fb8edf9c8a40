#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "posed_mapping.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/object_tracker.h"
#include "slam/snapshot/byte_archive.h"
#include "solid_overlap.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::SolidIoU;
using testing::SyntheticDesk;

struct DeskMap {
  std::vector<SnapshotObject> objects;
  std::unordered_map<std::int64_t, int> point_objects;
};

DeskMap MapDesk(const SyntheticDesk& desk, const ObjectOptions& options, const Sim3d& S_map_world = {},
                int transform_at = -1) {
  ObjectTracker tracker(options);
  ObjectMapper mapper(options, 1);
  bool moved = transform_at < 0;
  const auto pose = [&](const Rigid3d& T) -> Rigid3d {
    return moved ? Rigid3d{S_map_world.rotation * T.rotation, S_map_world * T.translation} : T;
  };
  const PointLookup lookup = [&](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    const auto p = desk.Position(id);
    return p && moved ? S_map_world * *p : p;
  };
  mapper.SetUpright(true,
                    SupportSurfaces::Everywhere(moved ? (S_map_world * Eigen::Vector3d::Zero()).z() : 0.0));
  for (int i = 0; i < SyntheticDesk::kFrames; i += 2) {
    if (i == transform_at) {
      moved = true;
      tracker.Transform(S_map_world);
      mapper.Transform(S_map_world);
    }
    ObjectFrame frame = desk.Frame(i);
    frame.T_map_camera = pose(frame.T_map_camera);
    for (TrackedPoint& point : frame.points) {
      point.p_map = moved ? S_map_world * point.p_map : point.p_map;
    }
    mapper.AddObservations(tracker.Track(frame, *mapper.View()));
    if (i % 20 == 18) {
      mapper.Update(lookup, desk.Camera());
    }
  }
  mapper.UpdateAll(lookup, desk.Camera());
  return {mapper.Objects(), mapper.PointObjects()};
}

// Mean IoU over the desk's objects; each must be there exactly once.
double CheckAndScore(const SyntheticDesk& desk, const DeskMap& run, const Sim3d& S_map_world = {}) {
  EXPECT_EQ(run.objects.size(), desk.Objects().size());
  double sum = 0.0;
  for (const SyntheticDesk::Object& truth : desk.Objects()) {
    PosedSuperquadric expected = truth.superquadric;
    expected.shape.half_size *= S_map_world.scale;
    expected.T_map_object = {S_map_world.rotation * expected.T_map_object.rotation,
                             S_map_world * expected.T_map_object.translation};
    double best = 0.0;
    int found = 0;
    for (const SnapshotObject& object : run.objects) {
      const double iou = SolidIoU(object.superquadric, expected, 32);
      found += iou > 0.1 ? 1 : 0;
      if (iou > best) {
        best = iou;
        EXPECT_EQ(object.label, truth.label);
      }
    }
    EXPECT_EQ(found, 1) << truth.label;
    sum += best;
  }
  return sum / static_cast<double>(desk.Objects().size());
}

TEST(ObjectPipeline, MapsEachOfTenObjectsOnceAndWell) {
  const SyntheticDesk desk(1);
  const DeskMap run = MapDesk(desk, ObjectOptions());
  const double refined = CheckAndScore(desk, run);
  EXPECT_GT(refined, 0.7);
  DeskMap ellipsoids = run;
  for (SnapshotObject& object : ellipsoids.objects) {
    object.superquadric.shape.e1 = object.superquadric.shape.e2 = 1.0;
  }
  EXPECT_GT(refined, CheckAndScore(desk, ellipsoids) + 0.1);
  ObjectOptions options;
  options.method = ObjectMethod::kPaper;
  const DeskMap paper = MapDesk(desk, options);
  EXPECT_GE(paper.objects.size(), desk.Objects().size()) << "its t-test leaves some of them twice";
  EXPECT_GT(run.point_objects.size(), 300u);
}

// Boxes with 8 % of noise on every edge, one in ten missed, 3 % of another label, and false boxes that come
// and go.
TEST(ObjectPipeline, SurvivesMissedWrongAndFalseBoxes) {
  const SyntheticDesk desk(2, 0.08);
  ObjectTracker tracker((ObjectOptions()));
  ObjectMapper mapper(ObjectOptions(), 1);
  mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  for (int i = 0; i < SyntheticDesk::kFrames; i += 2) {
    ObjectFrame frame = desk.Frame(i);
    if (i % 12 < 4) {
      frame.detections.push_back({"kite", 0.5, {60.0 + 4.0 * i, 60.0, 90.0, 120.0}});
    }
    mapper.AddObservations(tracker.Track(frame, *mapper.View()));
    if (i % 20 == 18) {
      mapper.Update(lookup, desk.Camera());
    }
  }
  mapper.UpdateAll(lookup, desk.Camera());
  EXPECT_GT(CheckAndScore(desk, {mapper.Objects(), mapper.PointObjects()}), 0.5);
}

// A thing seen too rarely to be shown is deleted when it stays away, and its id is never used again.
TEST(ObjectPipeline, OutdatedObjectsAreEstimatedAFewAtATime) {
  const SyntheticDesk desk(5);
  ObjectOptions options;
  options.max_estimates = 2;
  ObjectTracker tracker(options);
  ObjectMapper mapper(options, 1);
  mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
  for (int i = 0; i < SyntheticDesk::kFrames; ++i) {
    mapper.AddObservations(tracker.Track(desk.Frame(i), *mapper.View()));
  }
  const auto lookup = [&](std::int64_t& id) { return desk.Position(id); };
  mapper.UpdateAll(lookup, desk.Camera());
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

TEST(ObjectPipeline, ForgetsWhatWasSeenOnceOnly) {
  const SyntheticDesk desk(1);
  ObjectOptions options;
  options.forget_after = 20;
  ObjectTracker tracker(options);
  ObjectMapper mapper(options, 1);
  mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  const auto run = [&](int begin, int end, bool with_false_box) {
    for (int i = begin; i < end; ++i) {
      ObjectFrame frame = desk.Frame(i);
      if (with_false_box) {
        frame.detections.push_back({"kite", 0.5, {20.0, 200.0, 80.0, 80.0}});
      }
      mapper.AddObservations(tracker.Track(frame, *mapper.View()));
    }
    mapper.Update(lookup, desk.Camera());
  };
  const auto kites = [&] {
    const auto& landmarks = mapper.View()->landmarks;
    return std::count_if(landmarks.begin(), landmarks.end(), [](const auto& l) { return l.label == "kite"; });
  };
  run(0, 3, true);
  EXPECT_EQ(kites(), 1);
  const int next_id = tracker.NextId();
  run(3, 40, false);
  EXPECT_EQ(kites(), 0);
  EXPECT_FALSE(mapper.View()->deleted.empty());
  EXPECT_GE(tracker.NextId(), next_id);
}

TEST(ObjectPipeline, EstimatesNoMoreObjectsAtAKeyframeThanAllowed) {
  const SyntheticDesk desk(1);
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  const auto estimated_after = [&](int max_estimates, int updates) {
    ObjectOptions options;
    options.max_estimates = max_estimates;
    ObjectTracker tracker(options);
    ObjectMapper mapper(options, 1);
    mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
    for (int i = 0; i < 20; ++i) {
      mapper.AddObservations(tracker.Track(desk.Frame(i), *mapper.View()));
    }
    for (int i = 0; i < updates; ++i) {
      mapper.Update(lookup, desk.Camera());
    }
    const auto& landmarks = mapper.View()->landmarks;
    return std::count_if(landmarks.begin(), landmarks.end(), [](const auto& l) { return l.estimated; });
  };
  const auto all = estimated_after(0, 1);
  EXPECT_GT(all, 4);
  EXPECT_EQ(estimated_after(2, 1), 2);
  EXPECT_EQ(estimated_after(2, 2), 4);
  EXPECT_EQ(estimated_after(2, 10), all);
}

TEST(ObjectTracker, TellsOfPointsOutsideAsItsOptionSays) {
  const SyntheticDesk desk(1, 0.12);
  const auto outside_points = [&](ReprojectionVotes reprojection) {
    ObjectOptions options;
    options.outliers.reprojection = reprojection;
    ObjectTracker tracker(options);
    ObjectMapper mapper(options, 1);
    mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
    const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
    std::size_t count = 0;
    for (int i = 0; i < 40; ++i) {
      const std::vector<ObjectObservation> observations = tracker.Track(desk.Frame(i), *mapper.View());
      for (const ObjectObservation& observation : observations) {
        count += observation.reprojected_outside.size();
      }
      mapper.AddObservations(observations);
      if (i % 10 == 9) {
        mapper.Update(lookup, desk.Camera());
      }
    }
    return count;
  };
  const std::size_t all = outside_points(ReprojectionVotes::kAll);
  const std::size_t observed = outside_points(ReprojectionVotes::kObserved);
  EXPECT_EQ(outside_points(ReprojectionVotes::kNone), 0u);
  EXPECT_GT(observed, 0u);
  EXPECT_GT(all, observed);
}

TEST(ObjectTracker, LooksForLinesWithinItsBudgetButAlwaysInNewObjects) {
  const SyntheticDesk desk(1, 0.12);
  const auto looks = [&](int line_pixels, int line_views) {
    ObjectOptions options;
    options.yaw.line_interval = 1;
    options.yaw.line_pixels = line_pixels;
    options.yaw.line_views = line_views;
    ObjectTracker tracker(options);
    std::map<int, int> views_with_lines;  // by object
    for (int i = 0; i < 20; ++i) {
      ObjectFrame frame = desk.Frame(i);
      frame.gray = cv::Mat(frame.camera.height, frame.camera.width, CV_8U, cv::Scalar(40));
      for (int y = 0; y < frame.gray.rows; y += 32) {
        for (int x = 0; x < frame.gray.cols; x += 32) {
          cv::rectangle(frame.gray, {x, y}, {x + 23, y + 23}, cv::Scalar(220), cv::FILLED);
        }
      }
      for (const ObjectObservation& observation : tracker.Track(frame, ObjectMapView())) {
        views_with_lines[observation.object_id] += observation.lines.empty() ? 0 : 1;
      }
    }
    return views_with_lines;
  };
  const auto most = [](const std::map<int, int>& views) {
    return std::ranges::max_element(views, {}, [](const auto& v) { return v.second; })->second;
  };
  const auto sum = [](const std::map<int, int>& views) {
    return std::accumulate(views.begin(), views.end(), 0, [](int n, const auto& v) { return n + v.second; });
  };
  EXPECT_EQ(sum(looks(1, 0)), 1);  // the first box is a debt for ever
  const auto few = looks(1, 3);
  EXPECT_EQ(most(few), 3);
  EXPECT_GE(sum(few), 2 * static_cast<int>(few.size()));
  EXPECT_GT(most(looks(0, 0)), 10);
}

// A thing without a single map point: its boxes and the surface under it are enough.
TEST(ObjectPipeline, MapsABareThing) {
  const SyntheticDesk desk(1);
  for (const std::size_t bare : {0U, 3U, 6U}) {
    const PosedSuperquadric& truth = desk.Objects()[bare].superquadric;
    const Rigid3d T_object_world = truth.T_map_object.Inverse();
    const auto is_on_it = [&](const Eigen::Vector3d& p) {
      return truth.shape.RadialScale(T_object_world * p) < 1.5;
    };
    ObjectTracker tracker((ObjectOptions()));
    ObjectMapper mapper(ObjectOptions(), 1);
    mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
    const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
    for (int i = 0; i < SyntheticDesk::kFrames; i += 2) {
      ObjectFrame frame = desk.Frame(i);
      std::erase_if(frame.points, [&](const TrackedPoint& point) { return is_on_it(point.p_map); });
      mapper.AddObservations(tracker.Track(frame, *mapper.View()));
      if (i % 20 == 18) {
        mapper.Update(lookup, desk.Camera());
      }
    }
    mapper.UpdateAll(lookup, desk.Camera());
    double best = 0.0;
    int found = 0;
    for (const SnapshotObject& object : mapper.Objects()) {
      const double iou = SolidIoU(object.superquadric, truth, 32);
      best = std::max(best, iou);
      found += iou > 0.1 ? 1 : 0;
    }
    EXPECT_GT(best, 0.5) << desk.Objects()[bare].label;
    EXPECT_EQ(found, 1) << desk.Objects()[bare].label;
  }
}

// But not a second time where it is known, or where something else is expected.
TEST(ObjectTracker, ABareBoxBeginsNothingWhereAThingIsExpected) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectFrame frame = desk.Frame(0);
  frame.points = {{1, {20.0, 20.0}, {0.0, 0.0, 0.0}}};
  frame.detections = {{"cup", 0.9, {200.0, 200.0, 60.0, 60.0}}};
  EXPECT_EQ(tracker.Track(frame, ObjectMapView()).size(), 1U);
  ++frame.frame_index;
  frame.detections = {{"bowl", 0.9, {230.0, 210.0, 60.0, 60.0}}};
  EXPECT_TRUE(tracker.Track(frame, ObjectMapView()).empty());
  frame.detections = {{"bowl", 0.9, {400.0, 210.0, 60.0, 60.0}}};
  EXPECT_EQ(tracker.Track(frame, ObjectMapView()).size(), 1U);
  ObjectOptions paper;
  paper.method = ObjectMethod::kPaper;
  EXPECT_TRUE(ObjectTracker(paper).Track(frame, ObjectMapView()).empty()) << "the paper needs points";
}

TEST(ObjectPipeline, IsDeterministic) {
  const SyntheticDesk desk(3);
  const DeskMap a = MapDesk(desk, ObjectOptions());
  const DeskMap b = MapDesk(desk, ObjectOptions());
  ASSERT_EQ(a.objects.size(), b.objects.size());
  for (std::size_t i = 0; i < a.objects.size(); ++i) {
    EXPECT_EQ(a.objects[i].superquadric.shape.half_size, b.objects[i].superquadric.shape.half_size);
    EXPECT_EQ(a.objects[i].superquadric.T_map_object.translation,
              b.objects[i].superquadric.T_map_object.translation);
  }
}

TEST(ObjectPipeline, WorksAtAnyScaleAndSurvivesAMoveOfTheMap) {
  const SyntheticDesk desk(1);
  const Sim3d move{
      7.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitZ())), {3.0, -2.0, 1.0}};
  EXPECT_GT(CheckAndScore(desk, MapDesk(desk, ObjectOptions(), move), move), 0.65);
  EXPECT_GT(CheckAndScore(desk, MapDesk(desk, ObjectOptions(), move, 60), move), 0.65);
}

TEST(ObjectPipeline, FollowsFusedPointsAndForgetsCulledOnes) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectMapper mapper(ObjectOptions(), 1);
  mapper.SetUpright(true, SupportSurfaces::Everywhere(0.0));
  for (int i = 0; i < 30; ++i) {
    mapper.AddObservations(tracker.Track(desk.Frame(i), *mapper.View()));
  }
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

// What an earlier run has shown keeps its id in the next, also where that one would not have shown it.
TEST(ObjectPipeline, AnEarlierRunsObjectsStay) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectMapper first(ObjectOptions(), 1);
  first.SetUpright(true, SupportSurfaces::Everywhere(0.0));
  for (int i = 0; i < 30; ++i) {
    first.AddObservations(tracker.Track(desk.Frame(i), *first.View()));
  }
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  first.UpdateAll(lookup, desk.Camera());
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

TEST(ObjectTracker, MakesNothingOfAFrameWithoutPointsOrBoxes) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectFrame frame = desk.Frame(0);
  frame.points.clear();
  EXPECT_TRUE(tracker.Track(frame, ObjectMapView()).empty());
  frame = desk.Frame(1);
  frame.detections.clear();
  EXPECT_TRUE(tracker.Track(frame, ObjectMapView()).empty());
}

// The rendered desk with known poses and points triangulated from its images; half the sequence, for time.
TEST(ObjectPipeline, MapsTheRenderedDesk) {
  const auto folder = std::filesystem::path(SQSLAM_SOURCE_DIR) / "../shared/data/blender_desk_a";
  const auto sequence = testing::LoadPosedSequence(folder, "boxes_noisy.txt");
  if (!sequence) {
    GTEST_SKIP() << "no sequence at " << folder;
  }
  testing::PosedMapping mapping(sequence->camera);
  ObjectTracker tracker((ObjectOptions()));
  ObjectMapper mapper(ObjectOptions(), 1);
  mapper.SetUpright(true, SupportSurfaces::Everywhere(0.74));
  const PointLookup lookup = [&](std::int64_t& id) { return mapping.Position(id); };
  for (int i = 0; i < 100; ++i) {
    const auto& entry = sequence->entries[i];
    ObjectFrame frame;
    frame.frame_index = i;
    frame.T_map_camera = entry.T_world_camera;
    frame.camera = sequence->camera;
    frame.detections = entry.detections;
    frame.gray = cv::imread(entry.image.string(), cv::IMREAD_GRAYSCALE);
    frame.points = mapping.Process(frame.gray, frame.T_map_camera, i);
    mapper.AddObservations(tracker.Track(frame, *mapper.View()));
    if (i % 10 == 0) {
      mapper.Update(lookup, sequence->camera);
    }
  }
  mapper.UpdateAll(lookup, sequence->camera);
  const std::vector<SnapshotObject> objects = mapper.Objects();
  double sum = 0.0;
  for (const auto& truth : sequence->objects) {
    double best = 0.0;
    for (const SnapshotObject& object : objects) {
      best = std::max(best, SolidIoU(object.superquadric, truth.superquadric, 32));
    }
    sum += best;
  }
  EXPECT_LE(objects.size(), 12u);
  EXPECT_GE(objects.size(), 9u);
  EXPECT_GT(sum / static_cast<double>(sequence->objects.size()), 0.5);
}

}  // namespace
}  // namespace sqslam
