#include "app/viewer/model/annotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

using Eigen::Vector3d;
using Kind = SolidHandle::Kind;

Solid Box() { return UprightSolid(SolidKind::kCuboid, {1.0, 2.0, 0.5}, 0.3, {0.4, 0.2, 0.5}); }

// A line of sight from above, a little aside, to a point.
Ray To(const Vector3d& p, const Vector3d& eye = {0.5, -3.0, 4.0}) { return {eye, p - eye}; }

TEST(Annotation, GivesNewSolidsUniqueIds) {
  Annotation annotation;
  EXPECT_EQ(annotation.Add({0, "cup", "", Box(), ""}), 1);
  EXPECT_EQ(annotation.Add({0, "cup", "", Box(), ""}), 2);
  annotation.Remove(1);
  EXPECT_EQ(annotation.Find(1), nullptr);
  EXPECT_EQ(annotation.Add({0, "book", "", Box(), ""}), 3) << "ids are not used twice";
  AnnotatedSolid changed = *annotation.Find(2);
  changed.label = "mug";
  annotation.Replace(changed);
  EXPECT_EQ(annotation.Find(2)->label, "mug");
  changed.id = 8;
  EXPECT_THROW(annotation.Replace(changed), UsageError);
}

TEST(Annotation, RejectsInvalidSolids) {
  Annotation annotation;
  Solid flat = Box();
  flat.half_size.z() = 0.0;
  EXPECT_THROW(annotation.Add({0, "a", "", flat, ""}), UsageError);
  Solid sharp = Box();
  sharp.e1 = 0.01;
  EXPECT_THROW(annotation.Add({0, "a", "", sharp, ""}), UsageError);
  Solid nowhere = Box();
  nowhere.T_map_object.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(annotation.Add({0, "a", "", nowhere, ""}), UsageError);
  EXPECT_TRUE(annotation.solids.empty());
}

TEST(Annotation, NamesKindsAndSetsTheirExponents) {
  EXPECT_STREQ(NameOf(SolidKind::kCylinder), "cylinder");
  Solid solid = Box();
  SetKind(solid, SolidKind::kCylinder);
  EXPECT_EQ(solid.e1, 0.1);
  EXPECT_EQ(solid.e2, 1.0);
  SetKind(solid, SolidKind::kSuperquadric);
  EXPECT_EQ(solid.e2, 1.0) << "a superquadric begins as what the solid was";
}

TEST(Annotation, KeepsTiltWhenYawIsSet) {
  Solid solid = Box();
  EXPECT_NEAR(YawOf(solid), 0.3, 1e-12);
  const Eigen::Quaterniond lean(Eigen::AngleAxisd(0.2, Vector3d::UnitX()));
  solid.T_map_object.rotation = solid.T_map_object.rotation * lean;
  SetYaw(solid, -1.0);
  EXPECT_NEAR(YawOf(solid), -1.0, 1e-12);
  const Vector3d up = solid.T_map_object.RotationMatrix().col(2);
  EXPECT_NEAR(std::acos(up.z()), 0.2, 1e-9);
}

TEST(Annotation, SnapsToTheGround) {
  Solid moved = Box();
  SnapToGround(moved, -0.25, GroundSnap::kMove);
  EXPECT_NEAR(BottomOf(moved), -0.25, 1e-12);
  EXPECT_EQ(moved.half_size.z(), 0.5);
  Solid extended = Box();  // from 0 to 1
  SnapToGround(extended, -0.5, GroundSnap::kExtend);
  EXPECT_NEAR(BottomOf(extended), -0.5, 1e-12);
  EXPECT_NEAR(extended.T_map_object.translation.z() + extended.half_size.z(), 1.0, 1e-12);
  Solid below = Box();
  SnapToGround(below, 3.0, GroundSnap::kExtend);
  EXPECT_NEAR(BottomOf(below), 3.0, 1e-12);
  EXPECT_EQ(below.half_size.z(), 0.5);
}

TEST(Annotation, KeepsOppositeSideWhenSideIsDragged) {
  const Solid start = Box();
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      const SolidHandle handle{Kind::kSide, axis, sign};
      const SolidHandle opposite{Kind::kSide, axis, -sign};
      const Vector3d side = HandlePosition(start, handle);
      const Vector3d outward = sign * start.T_map_object.RotationMatrix().col(axis);
      const Solid dragged = DragHandle(start, handle, To(side), To(side + 0.3 * outward));
      EXPECT_NEAR(dragged.half_size[axis], start.half_size[axis] + 0.15, 1e-9);
      EXPECT_LT((HandlePosition(dragged, opposite) - HandlePosition(start, opposite)).norm(), 1e-9);
      EXPECT_LT((HandlePosition(dragged, handle) - (side + 0.3 * outward)).norm(), 1e-9);
      const Solid through = DragHandle(start, handle, To(side), To(side - 5.0 * outward));
      EXPECT_GT(through.half_size[axis], 0.0) << "a side does not pass the opposite one";
      EXPECT_LT((HandlePosition(through, opposite) - HandlePosition(start, opposite)).norm(), 1e-9);
    }
  }
}

TEST(Annotation, MovesHorizontallyUnlessSeenEdgeOn) {
  const Solid start = Box();
  const Vector3d center = start.T_map_object.translation;
  const Solid level = DragHandle(start, {Kind::kCenter}, To(center), To(center + Vector3d(0.5, 0.7, 0.0)));
  EXPECT_LT((level.T_map_object.translation - (center + Vector3d(0.5, 0.7, 0.0))).norm(), 1e-9);
  const Vector3d beside(1.0, -4.0, 0.5);
  const Solid raised =
      DragHandle(start, {Kind::kCenter}, To(center, beside), To(center + Vector3d(0.1, 0.0, 0.4), beside));
  EXPECT_LT((raised.T_map_object.translation - (center + Vector3d(0.1, 0.0, 0.4))).norm(), 1e-9);
}

TEST(Annotation, FollowsMouseWhenYawIsDragged) {
  const Solid start = Box();
  const Vector3d handle = HandlePosition(start, {Kind::kYaw});
  const Vector3d center = start.T_map_object.translation;
  const Vector3d turned = center + Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * (handle - center);
  const Solid dragged = DragHandle(start, {Kind::kYaw}, To(handle), To(turned));
  EXPECT_NEAR(YawOf(dragged), 1.0, 1e-9);
  EXPECT_EQ(dragged.half_size, start.half_size);
}

TEST(Annotation, KeepsHandlesApart) {
  const Solid box = Box();
  const auto handles = SolidHandles();
  for (std::size_t i = 0; i < handles.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT((HandlePosition(box, handles[i]) - HandlePosition(box, handles[j])).norm(), 0.05);
    }
  }
}

}  // namespace
}  // namespace sqslam::viewer
