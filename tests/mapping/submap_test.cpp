#include "slam/mapping/submap.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "slam/geometry/lie.h"
#include "slam/snapshot/byte_archive.h"
#include "slam/snapshot/snapshot_codec.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

constexpr int kMinInliers = 25;
constexpr KeyframeId kReference = 2;
constexpr std::int64_t kOlder = 100;  // frames that see what the reference keyframe sees, from the same place
constexpr std::int64_t kNewer = 101;

class SubmapFramesTest : public ::testing::Test {
 protected:
  // Tracking has put both frames a little beside their places.
  SubmapFramesTest() {
    SyntheticMap world = MakeSyntheticMap({});
    camera_ = world.camera;
    truth_ = world.T_camera_map[kReference].Inverse();
    TrackedFrame frame;
    frame.features = world.map.At(kReference).features;
    frame.points = world.map.At(kReference).points;
    const std::vector<FrameMatch> matches = MatchesOf(frame, world.map.Levels());
    submap_ = std::make_unique<Submap>(0, std::make_unique<Map>(std::move(world.map)), MapperOptions{});
    Vector6d delta;
    delta << 0.01, -0.02, 0.01, 0.03, -0.02, 0.04;
    for (const std::int64_t index : {kOlder, kNewer}) {
      submap_->RecordFrame(index, 0.1 * static_cast<double>(index), {kReference, Perturb({}, delta)},
                           matches);
    }
  }
  double Error(std::int64_t frame) const {
    return (submap_->FramePose(frame)->translation - truth_.translation).norm();
  }

  Camera camera_;
  Rigid3d truth_;  // T_map_camera of both frames
  std::unique_ptr<Submap> submap_;
};

TEST_F(SubmapFramesTest, RefinesAllFramesAtTheEnd) {
  EXPECT_GT(Error(kOlder), 0.01);
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_LT(Error(kOlder), 1e-5);
  EXPECT_LT(Error(kNewer), 1e-5);
}

TEST_F(SubmapFramesTest, RefinesFramesThatAreNotAmongTheNewest) {
  submap_->RefineFrames(camera_, kMinInliers, 1);
  EXPECT_LT(Error(kOlder), 1e-5);
  EXPECT_GT(Error(kNewer), 0.01);
  submap_->RefineFrames(camera_, kMinInliers, 1);
  EXPECT_GT(Error(kNewer), 0.01);
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_LT(Error(kNewer), 1e-5);
}

TEST_F(SubmapFramesTest, MovesRefinedFramesWithKeyframes) {
  submap_->RefineFrames(camera_, kMinInliers, 1);
  Map& map = submap_->Map();
  const Eigen::Vector3d shift(0.5, 0.0, 0.0);
  map.At(kReference).T_camera_map.translation -= map.At(kReference).T_camera_map.rotation * shift;
  submap_->RefineFrames(camera_, kMinInliers);
  EXPECT_NEAR(Error(kOlder), 0.5, 1e-5);  // what it matched is forgotten
  EXPECT_LT(Error(kNewer), 1e-5);         // is found among the points, which have stayed
}

TEST_F(SubmapFramesTest, RefinesNewFramesOfRestoredMap) {
  ByteWriter writer;
  submap_->Save(writer);
  ByteReader reader(writer.Bytes(), "a map");
  Submap restored(reader, std::make_unique<Map>(submap_->Map().Levels()), camera_, MapperOptions{});
  restored.RecordFrame(kNewer + 1, 11.0, {kReference, {}});
  restored.RefineFrames(camera_, kMinInliers, 2);  // the new frame and one of the restored ones are left
  EXPECT_EQ(restored.Frames().size(), submap_->Frames().size() + 1);
}

TEST_F(SubmapFramesTest, AddsRefinedFramesToLastAdjustment) {
  submap_->RefineFrames(camera_, kMinInliers, 1);
  const std::vector<BundleFrame> frames = submap_->FramesBetween(10);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_LT((frames[0].T_camera_map.Inverse().translation - truth_.translation).norm(), 1e-5);
  EXPECT_GT((frames[1].T_camera_map.Inverse().translation - truth_.translation).norm(), 0.01);
  EXPECT_EQ(frames[0].matches.size(), frames[1].matches.size());
  EXPECT_GT(frames[0].matches.size(), 100U);
  EXPECT_EQ(submap_->FramesBetween(1).size(), 1U);
}

TEST(SubmapGravity, AppliesGivenGravityToFirstSubmapOnly) {
  MapperOptions options;
  options.gravity = "[0, 1, 0.3]";
  for (const std::int64_t number : {0, 1}) {
    SyntheticMap world = MakeSyntheticMap({});
    Submap submap(number, std::make_unique<Map>(std::move(world.map)), options);
    submap.KeepUpright(world.camera, false);
    MapSnapshot snapshot;
    submap.FillSnapshot(snapshot);
    EXPECT_EQ(snapshot.gravity_known, number == 0);
  }
}

TEST_F(SubmapFramesTest, PutsEachCovisiblePairIntoSnapshotOnce) {
  Map& map = submap_->Map();
  std::size_t pairs = 0;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.UpdateCovisibility(id);
  }
  for (const auto& [id, keyframe] : map.Keyframes()) {
    pairs += keyframe.covisibility.size();
  }
  MapSnapshot snapshot;
  submap_->FillSnapshot(snapshot);
  ASSERT_GT(pairs, 0u);
  EXPECT_EQ(2 * snapshot.covisibility.size(), pairs);
  for (const SnapshotCovisibility& pair : snapshot.covisibility) {
    EXPECT_LT(pair.first, pair.second);
    EXPECT_EQ(map.At(pair.second).covisibility.at(pair.first), pair.points);
  }
}

// Twelve boxes around the first points of the synthetic map. One more point, far off them, was seen in them
// too, and one that no box holds.
class SubmapObjectsTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kPoints = 60;

  SubmapObjectsTest() {
    SyntheticMap world = MakeSyntheticMap({});
    camera_ = world.camera;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < kPoints; ++k) {
      middle += world.points[k] / static_cast<double>(kPoints);
    }
    const Rigid3d T_map_camera = world.T_camera_map[0].Inverse();
    far_off_ = AddPoint(world, T_map_camera.translation + 4.0 * (middle - T_map_camera.translation));
    beside_ = AddPoint(world, middle + T_map_camera.rotation * Eigen::Vector3d(5.0, 0.0, 0.0));
    std::vector<ObjectObservation> observations;
    for (int i = 0; i < 12; ++i) {
      const Rigid3d& T_camera_map =
          world.T_camera_map[static_cast<std::size_t>(i) % world.T_camera_map.size()];
      ObjectObservation o;
      o.object_id = 3;
      o.frame_index = 1000 + i;
      o.T_map_camera = T_camera_map.Inverse();
      o.edge_free = {true, true, true, true};
      Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9);
      Eigen::Vector2d high = -low;
      for (std::size_t k = 0; k < kPoints; ++k) {
        const Eigen::Vector2d pixel = camera_.Project(T_camera_map * world.points[k]);
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
        o.point_ids.push_back(static_cast<std::int64_t>(k));
      }
      o.point_ids.push_back(far_off_);
      o.point_ids.push_back(beside_);
      const Eigen::Vector2d size = high - low;
      o.detection = {"box", 0.9, {low.x(), low.y(), size.x(), size.y()}};
      observations.push_back(o);
    }
    MapperOptions options;
    options.objects.min_reliability = 0.0;  // little is known of a box around scattered points
    submap_ = std::make_unique<Submap>(0, std::make_unique<Map>(std::move(world.map)), options);
    submap_->Objects().AddObservations(observations);
    submap_->MapObjects(camera_, true);
  }

  static PointId AddPoint(SyntheticMap& world, const Eigen::Vector3d& p_map) {
    return world.map.AddPoint(p_map, 0);
  }

  Camera camera_;
  PointId far_off_ = kNoPoint;
  PointId beside_ = kNoPoint;
  std::unique_ptr<Submap> submap_;
};

TEST_F(SubmapObjectsTest, MarksOutliersInSnapshots) {
  MapSnapshot snapshot;
  submap_->FillSnapshot(snapshot);
  const auto at = [&](PointId id) {
    const Eigen::Vector3f p = RecordedPosition(submap_->Map().Point(id).p_map);
    const auto it = std::find_if(snapshot.points.begin(), snapshot.points.end(),
                                 [&](const SnapshotPoint& point) { return point.p_map == p; });
    return it != snapshot.points.end() ? *it : SnapshotPoint();
  };
  EXPECT_EQ(at(far_off_).object_id, -1);
  EXPECT_EQ(at(far_off_).rejected_by, 3);
  EXPECT_EQ(at(beside_).rejected_by, 3);
  EXPECT_EQ(at(beside_).anomaly, 0.0F) << "its boxes had removed it before";
  int kept = 0;
  for (const SnapshotPoint& point : snapshot.points) {
    EXPECT_FALSE(point.object_id == 3 && point.rejected_by == 3);
    kept += point.object_id == 3 ? 1 : 0;
    EXPECT_TRUE(point.object_id != 3 || (point.anomaly > 0.0F && point.anomaly < 0.66F)) << point.anomaly;
    EXPECT_EQ(std::round(256.0F * point.anomaly), 256.0F * point.anomaly);
  }
  EXPECT_EQ(kept, submap_->Objects().Objects().at(0).points);
  EXPECT_EQ(snapshot.points.back().object_id, -1);
}

TEST_F(SubmapObjectsTest, AddsObjectsToBundleAdjustmentWhenSeenOftenEnough) {
  EXPECT_TRUE(submap_->ObjectTerms({.min_observations = 13}).empty());
  const std::vector<ObjectTerm> terms = submap_->ObjectTerms({.min_observations = 12});
  ASSERT_EQ(terms.size(), 1U);
  EXPECT_EQ(terms[0].id, 3);
  EXPECT_GT(terms[0].points.size(), kPoints / 2);
  ASSERT_EQ(terms[0].weights.size(), terms[0].points.size());
  EXPECT_EQ(*std::max_element(terms[0].weights.begin(), terms[0].weights.end()), 1.0);
  EXPECT_EQ(*std::min_element(terms[0].weights.begin(), terms[0].weights.end()), 0.0);
}

TEST_F(SubmapObjectsTest, DropsRemovedPoints) {
  const std::vector<ObjectTerm> before = submap_->ObjectTerms({});
  ASSERT_EQ(before.size(), 1U);
  const PointId gone = before[0].points[0];
  submap_->Map().RemovePoint(gone);
  const std::vector<ObjectTerm> after = submap_->ObjectTerms({});
  EXPECT_EQ(after[0].points.size(), before[0].points.size() - 1);
  EXPECT_NE(after[0].points[0], gone);
}

TEST_F(SubmapObjectsTest, AppliesCorrectionsThatFitTheBoxes) {
  const PosedSuperquadric before = submap_->ObjectTerms({}).at(0).superquadric;
  PosedSuperquadric corrected = before;
  corrected.shape.half_size *= 1.005;
  submap_->CorrectObjects({{3, corrected}, {99, corrected}}, camera_);  // 99: long gone
  EXPECT_EQ(submap_->ObjectTerms({}).at(0).superquadric.shape.half_size, corrected.shape.half_size);
  PosedSuperquadric absurd = before;
  absurd.shape.half_size *= 0.5;
  submap_->CorrectObjects({{3, absurd}}, camera_);
  EXPECT_EQ(submap_->ObjectTerms({}).at(0).superquadric.shape.half_size, corrected.shape.half_size);
  EXPECT_EQ(submap_->Objects().Objects().at(0).superquadric.shape.half_size, corrected.shape.half_size);
}

}  // namespace
}  // namespace sqslam
