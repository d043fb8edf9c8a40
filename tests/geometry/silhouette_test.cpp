#include "slam/geometry/silhouette.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

const Camera kCamera = {.width = 640, .height = 480, .fx = 520.0, .fy = 510.0, .cx = 311.0, .cy = 247.0};

// A camera at `eye` that looks at `target`, the map's z upwards in the image.
Rigid3d LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  Eigen::Matrix3d axes;
  axes.col(2) = (target - eye).normalized();
  axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {Eigen::Quaterniond(axes), eye};
}

// Pixels of surface points: on a grid even in the parameters, which crowds at the edges of boxes, and on one
// even in direction.
std::vector<Eigen::Vector2d> ProjectedSurface(const PosedSuperquadric& solid, const Camera& camera,
                                              const Rigid3d& T_map_camera, int steps = 300) {
  const Rigid3d T_camera_object = T_map_camera.Inverse() * solid.T_map_object;
  std::vector<Eigen::Vector2d> pixels;
  const auto add = [&](const Eigen::Vector3d& p_object) {
    const Eigen::Vector3d p = T_camera_object * p_object;
    if (p.z() > 1e-6) {
      pixels.push_back(camera.Project(p));
    }
  };
  for (int i = 0; i <= steps; ++i) {
    const double eta = std::numbers::pi * (static_cast<double>(i) / steps - 0.5);
    for (int j = 0; j < 2 * steps; ++j) {
      const double omega = std::numbers::pi * (static_cast<double>(j) / steps - 1.0);
      add(solid.shape.PointAt(eta, omega));
      const Eigen::Vector3d direction = solid.shape.half_size.cwiseProduct(
          Eigen::Vector3d(std::cos(eta) * std::cos(omega), std::cos(eta) * std::sin(omega), std::sin(eta)));
      add(direction / solid.shape.RadialScale(direction));
    }
  }
  return pixels;
}

double Support(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& direction) {
  double largest = -1e300;
  for (const Eigen::Vector2d& p : points) {
    largest = std::max(largest, p.dot(direction));
  }
  return largest;
}

// Distance of a point from the polygon (counter-clockwise or not); 0 inside. For convex polygons.
double Outside(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  double area = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    area += a.x() * b.y() - a.y() * b.x();
  }
  double distance = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d side = polygon[(i + 1) % polygon.size()] - a;
    if (side.norm() > 1e-6) {
      const double left = (side.x() * (p - a).y() - side.y() * (p - a).x()) / side.norm();
      distance = std::max(distance, area > 0.0 ? -left : left);
    }
  }
  return distance;
}

class SilhouetteOfShape : public testing::TestWithParam<std::array<double, 2>> {};

TEST_P(SilhouetteOfShape, EqualsHullOfProjectedSurface) {
  const auto [e1, e2] = GetParam();
  for (const Eigen::Vector3d& half_size :
       {Eigen::Vector3d(0.3, 0.2, 0.15), Eigen::Vector3d(0.4, 0.3, 0.01)}) {
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(1.1, -0.7, 0.5), Eigen::Vector3d(-0.2, 1.2, 0.02),
                                       Eigen::Vector3d(0.5, 0.6, 1.1)}) {
      const PosedSuperquadric solid = {
          {half_size, e1, e2},
          {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.1, 0.2, 1.0).normalized())),
           {0.05, 0.02, -0.03}}};
      const Rigid3d pose = LookAt(eye, {0.1, 0.0, 0.0});
      const std::vector<Eigen::Vector2d> outline = Silhouette(solid, kCamera, pose, 0.02, 2000.0);
      const std::vector<Eigen::Vector2d> surface = ProjectedSurface(solid, kCamera, pose);
      for (int i = 0; i < 90; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / 90;
        const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
        EXPECT_NEAR(Support(outline, direction), Support(surface, direction), 0.1)
            << "e1 " << e1 << " e2 " << e2 << " from " << eye.transpose() << " angle " << angle;
      }
      EXPECT_LT(outline.size(), 400u);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, SilhouetteOfShape,
                         testing::Values(std::array{1.0, 1.0}, std::array{0.1, 0.1}, std::array{0.1, 1.0},
                                         std::array{1.9, 0.3}, std::array{0.6, 1.9}, std::array{1.9, 1.9}));

TEST(SilhouetteTest, SphereGivesConic) {
  const double radius = 0.25;
  const PosedSuperquadric ball = {{Eigen::Vector3d::Constant(radius), 1.0, 1.0},
                                  {Eigen::Quaterniond::Identity(), {0.4, 0.1, 2.0}}};
  const Eigen::Vector3d center = ball.T_map_object.translation;
  const std::vector<Eigen::Vector2d> outline = Silhouette(ball, kCamera, {}, 0.01);
  ASSERT_GT(outline.size(), 20u);
  for (const Eigen::Vector2d& pixel : outline) {  // rays at the cone's half angle: cos² = 1 - r² / |c|²
    const double cosine = kCamera.Unproject(pixel).normalized().dot(center.normalized());
    EXPECT_NEAR(cosine * cosine, 1.0 - radius * radius / center.squaredNorm(), 1e-9);
  }
}

TEST(SilhouetteTest, ContainsVisiblePartOfTableBehindCamera) {
  const PosedSuperquadric table = {{{1.5, 1.0, 0.05}, 0.1, 0.1}, {}};
  const Rigid3d pose = LookAt({1.0, 0.2, 0.4}, {-0.5, 0.0, 0.0});
  const std::vector<Eigen::Vector2d> outline = Silhouette(table, kCamera, pose);
  ASSERT_GE(outline.size(), 3u);
  int seen = 0;
  for (const Eigen::Vector2d& p : ProjectedSurface(table, kCamera, pose, 200)) {
    if (p.x() > 0.0 && p.y() > 0.0 && p.x() < 639.0 && p.y() < 479.0) {
      ++seen;
      EXPECT_LT(Outside(outline, p), 0.1);
    }
  }
  EXPECT_GT(seen, 1000);
  const Eigen::Vector2d sky(320.0, 5.0);
  EXPECT_GT(Outside(outline, sky), 10.0);
}

TEST(SilhouetteTest, ReturnsNothingWhenInvisible) {
  const PosedSuperquadric box = {{{0.2, 0.2, 0.2}, 0.1, 0.1}, {}};
  EXPECT_TRUE(
      Silhouette(box, kCamera, {Eigen::Quaterniond::Identity(), {0.05, 0.0, 0.1}}).empty());  // from inside
  EXPECT_TRUE(Silhouette(box, kCamera, {Eigen::Quaterniond::Identity(), {0.0, 0.0, 2.0}}).empty());  // behind
  EXPECT_TRUE(Silhouette(box, kCamera, LookAt({2.0, 0.0, 0.0}, {2.0, 2.0, 0.0})).empty());           // beside
}

TEST(SilhouetteTest, DistortedOutlineFollowsLens) {
  Camera lens = kCamera;
  lens.distortion = {-0.25, 0.08, 0.001, -0.0005, 0.0};
  const PosedSuperquadric box = {{{0.5, 0.4, 0.3}, 0.1, 0.1}, {}};
  const Rigid3d pose = LookAt({1.2, -1.0, 0.8}, Eigen::Vector3d::Zero());
  const auto outline = Silhouette(box, lens, pose);
  const auto distorted = DistortedOutline(outline, lens);
  ASSERT_GT(distorted.size(), outline.size());
  for (std::size_t i = 0; i < distorted.size(); ++i) {
    EXPECT_LT((distorted[i] - distorted[(i + 1) % distorted.size()]).norm(), 9.0);
    EXPECT_LT(Outside(outline, lens.Undistort(distorted[i])), 0.01);
  }
}

}  // namespace
}  // namespace sqslam
