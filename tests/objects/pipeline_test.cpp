#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "flat_surface.h"
#include "posed_mapping.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/object_tracker.h"
#include "slam/snapshot/byte_archive.h"
#include "solid_overlap.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::FlatSurface;
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
  SupportSurfaces surfaces = FlatSurface(0.0);
  if (moved) {
    surfaces.Transform(S_map_world);
  }
  mapper.SetUpright(true, std::move(surfaces));
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
  mapper.SetUpright(true, FlatSurface(0.0));
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

// A thing without a single map point: its boxes and the surface under it are enough.
TEST(ObjectPipeline, MapsObjectWithoutPoints) {
  const SyntheticDesk desk(1);
  for (const std::size_t bare : {0U, 3U, 6U}) {
    const PosedSuperquadric& truth = desk.Objects()[bare].superquadric;
    const Rigid3d T_object_world = truth.T_map_object.Inverse();
    const auto is_on_it = [&](const Eigen::Vector3d& p) {
      return truth.shape.RadialScale(T_object_world * p) < 1.5;
    };
    ObjectTracker tracker((ObjectOptions()));
    ObjectMapper mapper(ObjectOptions(), 1);
    mapper.SetUpright(true, FlatSurface(0.0));
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

TEST(ObjectPipeline, RepeatsExactly) {
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
  mapper.SetUpright(true, FlatSurface(0.74));
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
