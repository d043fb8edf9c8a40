#include "slam/snapshot/snapshot_codec.h"

#include <gtest/gtest.h>

#include <limits>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "tests/snapshot/sample_snapshots.h"

namespace sqslam {
namespace {

using testing::MakeSnapshot;

TEST(SnapshotCodec, RestoresEveryField) {
  const MapSnapshot snapshot = MakeSnapshot(3);
  const MapSnapshot read = DecodeSnapshot(EncodeSnapshot(snapshot));
  EXPECT_EQ(read.sequence_number, 3);
  EXPECT_EQ(read.frame_index, 30);
  EXPECT_EQ(read.timestamp, snapshot.timestamp);
  EXPECT_EQ(read.image_path, snapshot.image_path);
  EXPECT_EQ(read.camera.fy, 501.0);
  EXPECT_EQ(read.camera.fps, 25.0);
  EXPECT_EQ(read.camera.distortion, snapshot.camera.distortion);
  EXPECT_EQ(read.T_map_camera->Matrix(), snapshot.T_map_camera->Matrix());
  ASSERT_EQ(read.keyframes.size(), 1u);
  EXPECT_EQ(read.keyframes[0].id, 3);
  EXPECT_EQ(read.keyframes[0].frame_index, 30);
  EXPECT_EQ(read.keyframes[0].T_map_camera.Matrix(), snapshot.T_map_camera->Matrix());
  ASSERT_EQ(read.points.size(), 100u);
  EXPECT_TRUE(read.points[42].p_map.isApprox(snapshot.points[42].p_map, 2e-5F));
  EXPECT_EQ(read.points[42].rgb, snapshot.points[42].rgb);
  EXPECT_EQ(read.points[42].object_id, snapshot.points[42].object_id);
  EXPECT_EQ(read.points[42].anomaly, 0.328125F);
  EXPECT_EQ(read.points[42].rejected_by, -1);
  EXPECT_EQ(read.points[45].rejected_by, 2);
  ASSERT_EQ(read.objects.size(), 1u);
  EXPECT_EQ(read.objects[0].label, "cup");
  EXPECT_EQ(read.objects[0].observations, 6);
  EXPECT_EQ(read.objects[0].points, 7);
  EXPECT_EQ(read.objects[0].yaw, 0.25);
  EXPECT_EQ(read.objects[0].superquadric.shape.half_size, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read.objects[0].superquadric.shape.e2, 0.5);
  EXPECT_EQ(read.objects[0].fit.box_agreement, 0.7);
  EXPECT_EQ(read.objects[0].fit.reliability, 0.55);
  EXPECT_EQ(read.objects[0].fit.point_rms, 0.02);
  EXPECT_EQ(read.objects[0].fit.covariance, snapshot.objects[0].fit.covariance);
  ASSERT_EQ(read.detections.size(), 1u);
  EXPECT_EQ(read.detections[0].detection.box.height, 4.0);
  EXPECT_EQ(read.detections[0].object_id, 4);
  EXPECT_TRUE(read.gravity_known);
  EXPECT_EQ(read.support_height, 0.75);
  ASSERT_TRUE(read.progress.has_value());
  EXPECT_EQ(read.progress->tracked_points, 250);
  EXPECT_EQ(read.progress->tracking_ms, 7.5);
  EXPECT_EQ(read.progress->mapping_ms, 80.25);
  EXPECT_EQ(read.progress->counters.loops, 2);
  EXPECT_EQ(read.progress->counters.merges, 1);
  ASSERT_EQ(read.covisibility.size(), 2u);
  EXPECT_EQ(read.covisibility[0].first, 3);
  EXPECT_EQ(read.covisibility[0].second, 8);
  EXPECT_EQ(read.covisibility[0].points, 120);
  EXPECT_FALSE(DecodeSnapshot(EncodeSnapshot(MapSnapshot{})).T_map_camera.has_value());
}

TEST(SnapshotCodec, KeepsFisheyeLensAndRefusesUnknownOne) {
  MapSnapshot snapshot = MakeSnapshot(3);
  snapshot.camera.lens = LensModel::kFisheye;
  EXPECT_EQ(DecodeSnapshot(EncodeSnapshot(snapshot)).camera.lens, LensModel::kFisheye);
  snapshot.camera.lens = static_cast<LensModel>(7);
  EXPECT_THROW(DecodeSnapshot(EncodeSnapshot(snapshot)), InputError);
}

TEST(SnapshotCodec, RestoresRecordedPositionsExactly) {
  MapSnapshot snapshot;
  const Eigen::Vector3d p(1.0 / 3.0, -1234.5678, 1e-7);
  snapshot.points.resize(2);
  snapshot.points[1].p_map = RecordedPosition(p);
  EXPECT_TRUE((snapshot.points[1].p_map.cast<double>() - p).cwiseQuotient(p).cwiseAbs().maxCoeff() < 1.6e-5);
  EXPECT_EQ(DecodeSnapshot(EncodeSnapshot(snapshot)).points[1].p_map, snapshot.points[1].p_map);
}

TEST(SnapshotCodec, RefusesBrokenBytes) {
  const std::string bytes = EncodeSnapshot(MakeSnapshot(1));
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, 4)), InputError);
  EXPECT_THROW(DecodeSnapshot(bytes.substr(0, bytes.size() / 2)), InputError);
  EXPECT_THROW(DecodeSnapshot(bytes + 'x'), InputError);
}

TEST(SnapshotCodec, RefusesSizesThatAreNotFinite) {
  for (int axis = 0; axis < 3; ++axis) {
    MapSnapshot snapshot = MakeSnapshot(1);
    snapshot.objects[0].superquadric.shape.half_size[axis] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(DecodeSnapshot(EncodeSnapshot(snapshot)), InputError) << axis;
  }
}

TEST(SnapshotCodec, CutsLongLabelsBetweenCharacters) {
  const std::string letters(kMaxLabelBytes - 1, 'a');
  MapSnapshot snapshot = MakeSnapshot(1);
  snapshot.objects[0].label = letters + "é";
  snapshot.detections = {{{letters + "☕", 1.0, {}}, -1}};
  const MapSnapshot read = DecodeSnapshot(EncodeSnapshot(snapshot));
  EXPECT_EQ(read.objects[0].label, letters);
  EXPECT_EQ(read.detections[0].detection.label, letters);
}

TEST(SnapshotCodec, RefusesTooManyObjects) {
  MapSnapshot snapshot = MakeSnapshot(1);
  const SnapshotObject object = snapshot.objects[0];
  snapshot.objects.assign(kMaxObjects, object);
  EXPECT_EQ(DecodeSnapshot(EncodeSnapshot(snapshot)).objects.size(), kMaxObjects);
  snapshot.objects.push_back(object);
  EXPECT_THROW(DecodeSnapshot(EncodeSnapshot(snapshot)), InputError);
}

}  // namespace
}  // namespace sqslam
