#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/viewer/model/annotation.h"

namespace sqslam::viewer {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Camera kCamera{.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 319.5, .cy = 239.5};

// Looks from `eye` at the origin, z up.
Rigid3d LookingFrom(const Vector3d& eye) {
  Eigen::Matrix3d axes;
  axes.col(2) = -eye.normalized();
  axes.col(0) = axes.col(2).cross(Vector3d::UnitZ()).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {Eigen::Quaterniond(axes), eye};
}

int Hidden(const std::vector<WireLine>& lines) {
  return static_cast<int>(
      std::count_if(lines.begin(), lines.end(), [](const WireLine& line) { return line.hidden; }));
}

// The end of a line that is nearest to where a point of the map is seen, in pixels.
double DistanceToAnEnd(const std::vector<WireLine>& lines, const Vector3d& p_map, const Camera& camera,
                       const Rigid3d& T_map_camera) {
  const Vector2d pixel = camera.ProjectDistorted(T_map_camera.Inverse() * p_map);
  double nearest = 1e9;
  for (const WireLine& line : lines) {
    for (const Vector2d& end : {line.pixels.front(), line.pixels.back()}) {
      nearest = std::min(nearest, (end - pixel).norm());
    }
  }
  return nearest;
}

TEST(Wireframe, HidesThreeOfTwelveCuboidEdges) {
  const Solid box = UprightSolid(SolidKind::kCuboid, {0, 0, 0}, 0.4, {0.5, 0.3, 0.2});
  const Rigid3d pose = LookingFrom({3.0, -2.0, 2.0});
  const std::vector<WireLine> lines = ProjectWireframe(box, kCamera, pose);
  ASSERT_EQ(lines.size(), 12u);
  EXPECT_EQ(Hidden(lines), 3) << "three sides are seen";
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.3 : -0.3,
                     (corner & 4) != 0 ? 0.2 : -0.2);
    EXPECT_LT(DistanceToAnEnd(lines, box.T_map_object * p, kCamera, pose), 1e-6);
  }
  EXPECT_EQ(Hidden(ProjectWireframe(box, kCamera, LookingFrom({0.001, 0.0, 3.0}))), 8)
      << "from above only the lid is seen";
}

TEST(Wireframe, DistortsEdgesWithLens) {
  Camera lens = kCamera;
  lens.distortion = {-0.3, 0.1, 0.001, 0.0, 0.0};
  const Solid box = UprightSolid(SolidKind::kCuboid, {0.0, 0.0, 0.6}, 0.0, {1.0, 0.05, 0.05});
  const Rigid3d pose = LookingFrom({0.0, -3.0, 0.0});
  const std::vector<WireLine> lines = ProjectWireframe(box, lens, pose);
  ASSERT_EQ(lines.size(), 12u);
  double bend = 0.0;
  for (const WireLine& line : lines) {
    const Vector2d middle = line.pixels[line.pixels.size() / 2];
    const Vector2d chord = line.pixels.back() - line.pixels.front();
    const Vector2d aside = middle - line.pixels.front();
    bend = std::max(bend, std::abs(chord.x() * aside.y() - chord.y() * aside.x()) / chord.norm());
  }
  EXPECT_GT(bend, 1.0);
  EXPECT_LT(DistanceToAnEnd(lines, {1.0, -0.05, 0.65}, lens, pose), 1e-6);
}

TEST(Wireframe, JoinsCylinderSidesAndRims) {
  const Solid can = UprightSolid(SolidKind::kCylinder, {0, 0, 0}, 0.3, {0.3, 0.2, 0.4});
  const Rigid3d pose = LookingFrom({3.0, 1.0, 1.0});
  const std::vector<WireLine> lines = ProjectWireframe(can, kCamera, pose);
  // The upper rim is seen all around, the lower one in front; two straight sides.
  EXPECT_EQ(std::count_if(lines.begin(), lines.end(),
                          [](const WireLine& line) { return line.pixels.size() == 2 && !line.hidden; }),
            2);
  EXPECT_GE(Hidden(lines), 1);
  // No point of the surface lies outside of what the lines enclose: compare with the bounds of many points.
  Vector2d low(1e9, 1e9), high(-1e9, -1e9), line_low = low, line_high = high;
  for (int i = 0; i < 720; ++i) {
    const double a = 0.0087266 * i;
    for (const double z : {-0.4, 0.4}) {
      const Vector2d pixel = kCamera.Project(
          pose.Inverse() * (can.T_map_object * Vector3d(0.3 * std::cos(a), 0.2 * std::sin(a), z)));
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
  }
  for (const WireLine& line : lines) {
    for (const Vector2d& pixel : line.pixels) {
      line_low = line_low.cwiseMin(pixel);
      line_high = line_high.cwiseMax(pixel);
    }
  }
  EXPECT_LT((low - line_low).norm(), 0.3);
  EXPECT_LT((high - line_high).norm(), 0.3);
}

TEST(Wireframe, DrawsOutlineAndSectionOfEllipsoid) {
  const Solid ball = UprightSolid(SolidKind::kEllipsoid, {0, 0, 0}, 0.0, {0.3, 0.3, 0.3});
  const std::vector<WireLine> lines = ProjectWireframe(ball, kCamera, LookingFrom({0.0, -3.0, 1.0}));
  ASSERT_GE(lines.size(), 3u);
  EXPECT_GE(Hidden(lines), 1);
  const double radius = 500.0 * 0.3 / std::sqrt(10.0 - 0.09);
  for (const Vector2d& pixel : lines[0].pixels) {
    EXPECT_NEAR((pixel - Vector2d(319.5, 239.5)).norm(), radius, 0.1);
  }
  EXPECT_EQ(lines[0].pixels.front(), lines[0].pixels.back()) << "the outline is closed";
}

TEST(Wireframe, ClipsBehindCamera) {
  const Solid long_box = UprightSolid(SolidKind::kCuboid, {0, 0, 0}, 0.0, {0.3, 8.0, 0.2});
  const Rigid3d beside = {LookingFrom({0.0, -3.0, 0.0001}).rotation, {1.0, -3.0, 0.0}};
  const std::vector<WireLine> lines = ProjectWireframe(long_box, kCamera, beside);
  EXPECT_EQ(lines.size(), 8u) << "four edges reach behind the camera, four lie there";
  for (const WireLine& line : lines) {
    for (const Vector2d& pixel : line.pixels) {
      EXPECT_TRUE(pixel.allFinite());
    }
  }
  EXPECT_TRUE(ProjectWireframe(long_box, kCamera, LookingFrom({0.0, -3.0, 0.0001})).empty()) << "inside";
}

}  // namespace
}  // namespace sqslam::viewer
