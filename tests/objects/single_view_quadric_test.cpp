#include "slam/objects/single_view_quadric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "slam/geometry/angles.h"
#include "slam/geometry/solid_iou.h"
#include "slam/objects/landmark_geometry.h"
#include "test_camera.h"

namespace sqslam {
namespace {

constexpr double kSupport = 0.2;
constexpr double kYaw = 0.5;

// An egg on its support whose pattern is the same on both sides of its x-z plane and of no other.
PosedSuperquadric Egg(double width, double depth) {
  return {
      {{width, depth, 0.3}, 1.0, 1.0},
      {Eigen::Quaterniond(Eigen::AngleAxisd(kYaw, Eigen::Vector3d::UnitZ())), {0.4, 0.3, kSupport + 0.3}}};
}

int Pattern(const Eigen::Vector3d& p_object) {
  const double angle = std::abs(std::atan2(p_object.y(), p_object.x()));
  return static_cast<int>(120.0 + 60.0 * std::sin(5.0 * angle) +
                          40.0 * std::sin(17.0 * p_object.z() + angle));
}

// A camera to the side of the egg's x axis, somewhat above.
Rigid3d Pose(const PosedSuperquadric& egg) {
  const Eigen::Vector3d center = egg.T_map_object.translation;
  const Eigen::Vector3d from = center + Eigen::Vector3d(2.0 * std::cos(0.9), 2.0 * std::sin(0.9), 0.9);
  const Eigen::Vector3d z = (center - from).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return {Eigen::Quaterniond(R), from};
}

// The image by rays that meet the egg, without projecting any of its points.
cv::Mat Image(const PosedSuperquadric& egg, const Rigid3d& T_map_camera, const Camera& camera) {
  cv::Mat gray(camera.height, camera.width, CV_8UC1, cv::Scalar(20));
  const Rigid3d T_object_camera = egg.T_map_object.Inverse() * T_map_camera;
  const Eigen::Vector3d inverse = egg.shape.half_size.cwiseInverse();
  const Eigen::Vector3d o = T_object_camera.translation.cwiseProduct(inverse);
  for (int y = 0; y < gray.rows; ++y) {
    for (int x = 0; x < gray.cols; ++x) {
      const Eigen::Vector3d d = (T_object_camera.rotation * camera.Unproject({x, y})).cwiseProduct(inverse);
      const double root = std::pow(o.dot(d), 2) - d.squaredNorm() * (o.squaredNorm() - 1.0);
      if (root > 0.0) {
        const double t = (-o.dot(d) - std::sqrt(root)) / d.squaredNorm();
        gray.at<unsigned char>(y, x) =
            static_cast<unsigned char>(Pattern((o + t * d).cwiseQuotient(inverse)));
      }
    }
  }
  return gray;
}

Camera Pinhole() {
  Camera camera = testing::TestCamera();
  camera.distortion.fill(0.0);
  return camera;
}

double YawError(const PosedSuperquadric& found) {
  const double turn = YawOf(found.T_map_object.rotation) - kYaw;
  return std::abs(std::remainder(turn, 0.5 * 3.14159265358979));
}

TEST(QuadricFromOneView, FindsYawOfSymmetricTexture) {
  const Camera camera = Pinhole();
  const PosedSuperquadric egg = Egg(0.2, 0.2);  // round: its outline says nothing
  const Rigid3d pose = Pose(egg);
  const cv::Mat gray = Image(egg, pose, camera);
  PosedSuperquadric turned = egg;
  turned.T_map_object.rotation = Eigen::AngleAxisd(kYaw + 0.5, Eigen::Vector3d::UnitZ());
  EXPECT_LT(TextureAsymmetry(egg, pose, camera, gray).value(), 13.0);  // whole pixels
  EXPECT_GT(TextureAsymmetry(turned, pose, camera, gray).value(), 25.0);
  const BoxView view{0, pose, ProjectToBox(egg, pose, camera).value(), {true, true, true, true}};
  ObjectClass known;
  known.log_height_ratio = std::log(1.5);
  known.width_sigma = known.height_sigma = 0.05;
  const auto found = QuadricFromOneView(view, gray, camera, ObjectOptions(), {known, kSupport});
  ASSERT_TRUE(found);
  EXPECT_LT(YawError(*found), 0.06);  // tried every 5 degrees
}

TEST(QuadricFromOneView, TakesSizeFromBoxSupportAndClass) {
  const Camera camera = Pinhole();
  const PosedSuperquadric egg = Egg(0.3, 0.2);
  const Rigid3d pose = Pose(egg);
  BoxView view{0, pose, ProjectToBox(egg, pose, camera).value(), {true, true, true, true}};
  ObjectClass known;
  known.log_width_ratio = std::log(1.5);
  known.log_height_ratio = std::log(0.3 / std::sqrt(0.06));
  known.width_sigma = known.height_sigma = 0.05;
  const QuadricPriors priors{known, kSupport};
  const cv::Mat gray = Image(egg, pose, camera);
  const auto found = QuadricFromOneView(view, gray, camera, ObjectOptions(), priors);
  ASSERT_TRUE(found);
  EXPECT_GT(IoU(Solid::FromSuperquadric(*found), Solid::FromSuperquadric(egg)), 0.85);
  EXPECT_NEAR(found->T_map_object.translation.z() - found->shape.half_size.z(), kSupport, 0.02);
  view.edge_free[1] = false;
  EXPECT_FALSE(QuadricFromOneView(view, gray, camera, ObjectOptions(), priors)) << "not seen whole";
}

}  // namespace
}  // namespace sqslam
