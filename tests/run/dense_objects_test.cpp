#include "slam/run/dense_objects.h"

#include <gtest/gtest.h>

#include "slam/dense/dense_cloud.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"
#include "tests/objects/dense_box_scene.h"

namespace sqslam {
namespace {

using testing::DenseBoxScene;

// The result folder of a run that took the box for a plate.
class DenseObjectsResult : public ::testing::Test {
 protected:
  DenseObjectsResult() {
    SnapshotObject object;
    object.id = 3;
    object.label = "box";
    object.observations = static_cast<int>(scene_.poses.size());
    object.superquadric = scene_.Plate();
    object.fit.covariance.setIdentity();
    Trajectory trajectory;
    RecordingWriter recording(folder_.Path() / "map.sqmap", {"images", "test", ""});
    for (std::size_t i = 0; i < scene_.poses.size(); ++i) {
      MapSnapshot map;
      map.sequence_number = map.frame_index = static_cast<std::int64_t>(i);
      map.timestamp = static_cast<double>(i) / 30.0;
      map.camera = scene_.camera;
      map.gravity_known = true;
      map.objects = {object};
      map.detections = {{{"box", 0.9, scene_.Box(i)}, 3}};
      for (std::size_t k = 0; k < scene_.elsewhere.size(); k += 20) {
        map.points.push_back({scene_.elsewhere[k].p_map.cast<float>(), {}, -1});
      }
      trajectory.push_back({map.timestamp, scene_.poses[i]});
      recording.Add(map);
    }
    WriteTrajectory(folder_.Path() / "trajectory.txt", trajectory);
    WriteObjects(folder_.Path() / "objects.json", {object});
    DenseCloud cloud;
    for (const SurfacePoint& point : scene_.Cloud()) {
      cloud.push_back({point.p_map.cast<float>(), point.normal.cast<float>(), {}, 3});
    }
    WriteDenseCloud(folder_.Path() / "dense.ply", cloud);
  }

  double Volume() const {
    return ReadObjects(folder_.Path() / "objects.json").front().superquadric.shape.Volume();
  }

  const DenseBoxScene scene_;
  const TemporaryFolder folder_;
};

TEST_F(DenseObjectsResult, GetsTheEstimatesOfTheCloud) {
  ObjectOptions options;
  options.dense_evidence = DenseEvidence::kAuto;
  const DenseObjects objects = RefineObjectsWithCloud(folder_.Path(), options);
  EXPECT_EQ(objects.Text(), "estimated again with the dense cloud: 3 box");
  EXPECT_NEAR(Volume(), scene_.truth.shape.Volume(), 0.1 * scene_.truth.shape.Volume());
  const RecordingReader recording(folder_.Path() / "map.sqmap");
  EXPECT_EQ(recording.Size(), static_cast<int>(scene_.poses.size()) + 1);
  EXPECT_NEAR(recording.Last()->objects.front().superquadric.shape.Volume(), Volume(), 1e-6);
}

TEST_F(DenseObjectsResult, StaysAsItIsWhereTheOptionSaysSo) {
  ObjectOptions options;
  options.dense_evidence = DenseEvidence::kOff;
  EXPECT_EQ(RefineObjectsWithCloud(folder_.Path(), options).map, nullptr);
  EXPECT_NEAR(Volume(), scene_.Plate().shape.Volume(), 1e-9);
}

}  // namespace
}  // namespace sqslam
