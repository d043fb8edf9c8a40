#include "slam/objects/paper_method.h"

#include <gtest/gtest.h>

#include "flat_surface.h"
#include "slam/objects/association.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_outliers.h"
#include "slam/objects/merging.h"
#include "slam/objects/object_mapper.h"
#include "slam/objects/object_tracker.h"
#include "slam/objects/size_shape.h"
#include "synthetic_desk.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::FlatSurface;
using testing::SyntheticDesk;

ObjectOptions Paper() {
  ObjectOptions options;
  options.method = ObjectMethod::kPaper;
  return options;
}

std::vector<SnapshotObject> MapDeskBy(const SyntheticDesk& desk, const ObjectOptions& options) {
  ObjectTracker tracker(options);
  ObjectMapper mapper(options, 1);
  const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
  mapper.SetUpright(true, FlatSurface(0.0));
  for (int i = 0; i < SyntheticDesk::kFrames; i += 2) {
    mapper.AddObservations(tracker.Track(desk.Frame(i), *mapper.View()));
    if (i % 20 == 18) {
      mapper.Update(lookup, desk.Camera());
    }
  }
  mapper.UpdateAll(lookup, desk.Camera());
  return mapper.Objects();
}

TEST(PaperMethod, IgnoresPriors) {
  const SyntheticDesk desk(1);
  const std::vector<SnapshotObject> objects = MapDeskBy(desk, Paper());
  EXPECT_GE(objects.size(), desk.Objects().size());
  ObjectOptions other = Paper();
  other.class_priors = "off";
  other.size_shape.regularisation = 3.0;
  other.size_shape.prior_exponent = 1.7;
  other.refinement.exponent_sigma = 0.01;
  other.refinement.edge_bias_sigma = 0.5;
  other.outliers.depth_iqr = 0.5;
  other.merging.overlap = 0.01;
  const std::vector<SnapshotObject> same = MapDeskBy(desk, other);
  ASSERT_EQ(same.size(), objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const PosedSuperquadric& a = objects[i].superquadric;
    const PosedSuperquadric& b = same[i].superquadric;
    EXPECT_EQ(a.shape.half_size, b.shape.half_size);
    EXPECT_EQ(a.shape.e1, b.shape.e1);
    EXPECT_EQ(a.shape.e2, b.shape.e2);
    EXPECT_EQ(a.T_map_object.Matrix(), b.T_map_object.Matrix());
  }
}

TEST(PaperMethod, LeavesOptionsOfOtherMethods) {
  ObjectOptions options;
  options.size_shape.regularisation = 0.3;
  EXPECT_EQ(OptionsOfMethod(options).size_shape.regularisation, 0.3);
}

PointStatistics Centroids(double x, int count) {
  PointStatistics centroids;
  for (int i = 0; i < count; ++i) {
    centroids.Add({x + 0.01 * (i % 3 - 1), 0.01 * (i % 5 - 2), 0.01 * (i % 7 - 3)});
  }
  return centroids;
}

// Eq. 14: the longer the history, the less a single centroid may differ from its mean.
TEST(PaperMethod, UsesRootOfNInTheOneSampleTest) {
  BoxCandidate box;
  box.detection.label = "cup";
  box.centroid = Eigen::Vector3d(0.01, 0.0, 0.0);
  KnownLandmark landmark;
  landmark.labels.Add("cup", 1.0);
  const auto joins = [&](const ObjectOptions& options, int history) {
    landmark.centroids = Centroids(0.0, history);
    return Associate({box}, {&landmark}, OptionsOfMethod(options).association)[0] == 0;
  };
  EXPECT_TRUE(joins(Paper(), 6));
  EXPECT_FALSE(joins(Paper(), 105));
  EXPECT_TRUE(joins(ObjectOptions(), 105));
  // Shared points tell between consecutive frames only.
  box.point_ids = {1, 2, 3, 4, 5};
  landmark.point_ids = {1, 2, 3, 4, 5};
  EXPECT_FALSE(joins(Paper(), 105));
}

// Eq. 15: merged by their centroids, be they seen together or not, and by nothing else.
TEST(PaperMethod, MergesByTheTwoSampleTestAlone) {
  Landmark a;
  Landmark b;
  a.labels.Add("cup", 1.0);
  b.labels.Add("cup", 1.0);
  a.centroids = b.centroids = Centroids(0.0, 40);
  for (int frame = 0; frame < 20; ++frame) {
    a.views.push_back({frame, {}, {100.0, 100.0, 40.0, 40.0}, {}});
    b.views.push_back({frame, {}, {200.0, 100.0, 40.0, 40.0}, {}});
  }
  EXPECT_TRUE(AreDuplicates(a, b, OptionsOfMethod(Paper()), Camera()));
  EXPECT_FALSE(AreDuplicates(a, b, ObjectOptions(), Camera()));
  b.centroids = Centroids(0.02, 40);
  a.views.resize(1);
  a.estimated = b.estimated = true;  // of one and the same volume
  EXPECT_FALSE(AreDuplicates(a, b, OptionsOfMethod(Paper()), Camera()));
}

// Section "Reprojection": one box that a point falls outside removes it, the next that holds it takes it
// back.
TEST(PaperMethod, RejectsPointOutsideOneBox) {
  const ObjectOptions options = OptionsOfMethod(Paper());
  const PointLookup lookup = [](std::int64_t&) -> std::optional<Eigen::Vector3d> {
    return Eigen::Vector3d(0.0, 0.0, 3.0);
  };
  EstimationContext context;
  context.options = &options;
  context.points = &lookup;
  context.camera = testing::TestCamera();
  Landmark landmark;
  const auto see = [&](bool inside) {
    ObjectObservation o;
    o.detection = {"cup", 0.9, {270.0, 190.0, 100.0, 100.0}};
    (inside ? o.point_ids : o.reprojected_outside) = {7};
    landmark.Add(o);
    return RemoveOutliers(landmark, landmark.views, context).size();
  };
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(see(true), 1U);
  }
  EXPECT_EQ(see(false), 0U);
  EXPECT_EQ(see(true), 1U);
}

// Section "Pose Estimation": the centre is the mean of the points; section "Size And Shape": half of their
// extent.
TEST(PaperMethod, UsesCentroidAsCentre) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {0.9, 0.9, 0.9}};
  const PosedSuperquadric solid = SuperquadricAtYaw(points, 0.0, OptionsOfMethod(Paper()).size_shape);
  EXPECT_TRUE(solid.T_map_object.translation.isApprox(Eigen::Vector3d(0.78, 0.58, 0.38)));
  EXPECT_TRUE(solid.shape.half_size.isApprox(Eigen::Vector3d(0.5, 0.5, 0.5)));
}

}  // namespace
}  // namespace sqslam
