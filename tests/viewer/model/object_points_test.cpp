#include <gtest/gtest.h>

#include "app/viewer/model/map_objects.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {
namespace {

MapSnapshot DeskWithBallPoints() {
  MapSnapshot map = HandMadeMap();
  map.points.clear();
  const SnapshotObject& ball = map.objects[2];
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d p =
        ball.superquadric.T_map_object *
        ball.superquadric.shape.PointAt(-1.4 + 0.045 * i, -3.1 + 1.7 * (i % 4) + 0.01 * i);
    map.points.push_back({p.cast<float>(), {}, 2});
  }
  map.points.push_back({{0.3F, 0.4F, 0.5F}, {}, -1});  // 0.2 above the ball, rejected by it
  map.points.back().rejected_by = 2;
  map.points.back().anomaly = 0.75F;
  map.points.push_back({{0.0F, 0.0F, 0.0F}, {}, 0});
  return map;
}

TEST(ObjectPoints, IncludeRejectedPoints) {
  const MapSnapshot map = DeskWithBallPoints();
  const std::vector<ObjectPoint> points = ObjectPoints(map, map.objects[2]);
  ASSERT_EQ(points.size(), 61u);
  for (int i = 0; i < 60; ++i) {
    EXPECT_NEAR(points[static_cast<std::size_t>(i)].residual, 0.0, 1e-3);
    EXPECT_TRUE(points[static_cast<std::size_t>(i)].kept);
  }
  EXPECT_FALSE(points[60].kept);
  EXPECT_EQ(points[60].anomaly, 0.75);
  EXPECT_GT(points[60].residual, 0.19);
}

TEST(Representations, KeepPlaceAndSize) {
  const auto map = std::make_shared<const MapSnapshot>(HandMadeMap());
  EXPECT_EQ(Represented(map, SolidKind::kSuperquadric), map);
  const Superquadric& book = map->objects[0].superquadric.shape;
  for (const auto& [representation, exponent] :
       {std::pair(SolidKind::kEllipsoid, 1.0), {SolidKind::kCuboid, kMinShapeExponent}}) {
    const MapSnapshotPtr represented = Represented(map, representation);
    const Superquadric& shape = represented->objects[0].superquadric.shape;
    EXPECT_EQ(shape.e1, exponent);
    EXPECT_EQ(shape.e2, exponent);
    EXPECT_NEAR(shape.Volume() / book.Volume(), 1.0, 0.15);
  }
  EXPECT_EQ(book.e2, 0.2) << "the map itself stays";
  EXPECT_EQ(Represented(nullptr, SolidKind::kCuboid), nullptr);
}

}  // namespace
}  // namespace sqslam::viewer
