
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "slam/estimation/reprojection_error.h"
#include "slam/estimation/two_view.h"
#include "slam/geometry/lie.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

std::vector<PointObservation> ObservationsOf(const SyntheticMap& world, std::size_t keyframe) {
  std::vector<PointObservation> observations;
  for (const Eigen::Vector3d& p : world.points) {
    observations.push_back({p, world.camera.Project(world.T_camera_map[keyframe] * p), 1.0, true});
  }
  return observations;
}

// Central differences over Perturb(), the step that OptimizePose makes.
TEST(PoseJacobian, AgreesWithNumericOne) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 4, .points = 20});
  constexpr double kStep = 1e-6;
  for (const Rigid3d& pose : world.T_camera_map) {
    for (const Eigen::Vector3d& p : world.points) {
      const Eigen::Matrix<double, 2, 6> J = PoseJacobian(world.camera, pose, pose * p);
      for (int i = 0; i < 6; ++i) {
        const Vector6d step = kStep * Vector6d::Unit(i);
        const Eigen::Vector2d numeric =
            (world.camera.Project(Perturb(pose, step) * p) - world.camera.Project(Perturb(pose, -step) * p)) /
            (2.0 * kStep);
        EXPECT_LT((numeric - J.col(i)).norm(), 1e-6 * (1.0 + numeric.norm()));
      }
    }
  }
}

// Returns the scatter (px) of a corner of the image as predicted by poses that were fitted to noisy pixels,
// for one pixel of noise, in the corner where it is largest.
double ScatterOfCorners(const SyntheticMap& world, const Rigid3d& truth,
                        const std::vector<Eigen::Vector3d>& points, double depth) {
  constexpr int kTrials = 400;
  std::mt19937 random(5);
  std::normal_distribution<double> noise;
  double sums[4] = {};
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PointObservation> observations;
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector2d error(noise(random), noise(random));
      observations.push_back({p, world.camera.Project(truth * p) + 0.1 * error, 1.0, true});
    }
    Rigid3d pose = truth;
    OptimizePose(world.camera, observations, pose);
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector2d pixel((corner % 2) * world.camera.width, (corner / 2) * world.camera.height);
      const Eigen::Vector3d p = truth.Inverse() * (depth * world.camera.Unproject(pixel));
      sums[corner] += (world.camera.Project(pose * p) - pixel).squaredNorm() / 0.01;
    }
  }
  return std::sqrt(*std::max_element(sums, sums + 4) / kTrials);
}

TEST(CornerDeviation, AgreesWithScatterOfFittedPoses) {
  const SyntheticMap world = MakeSyntheticMap({});
  const Rigid3d& pose = world.T_camera_map[2];
  std::vector<Eigen::Vector3d> all;
  std::vector<double> depths;
  std::ranges::copy_if(world.points, std::back_inserter(all), [&](const Eigen::Vector3d& p) {
    return world.camera.Shows(world.camera.Project(pose * p));
  });
  std::ranges::transform(all, std::back_inserter(depths),
                         [&](const Eigen::Vector3d& p) { return (pose * p).z(); });
  std::vector<Eigen::Vector3d> in_one_part = all;  // of the image, around one of the points
  const Eigen::Vector2d center = world.camera.Project(pose * all.front());
  std::ranges::sort(in_one_part, {}, [&](const Eigen::Vector3d& p) {
    return (world.camera.Project(pose * p) - center).norm();
  });
  in_one_part.resize(all.size() / 10);
  std::ranges::sort(depths);
  const double predicted = CornerDeviation(world.camera, pose, all);
  EXPECT_NEAR(predicted / ScatterOfCorners(world, pose, all, depths[depths.size() / 2]), 1.0, 0.15);
  EXPECT_GT(CornerDeviation(world.camera, pose, in_one_part), 5.0 * predicted);
  in_one_part.resize(2);
  EXPECT_TRUE(std::isinf(CornerDeviation(world.camera, pose, in_one_part)));
}

TEST(OptimizePose, FindsPoseAndOutliers) {
  const SyntheticMap world = MakeSyntheticMap({});
  std::vector<PointObservation> observations = ObservationsOf(world, 2);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> pixel(0.0, 480.0);
  const std::size_t outliers = observations.size() / 4;
  for (std::size_t i = 0; i < outliers; ++i) {
    observations[i].pixel = {pixel(random), pixel(random)};
  }
  Vector6d delta;
  delta << 0.03, -0.02, 0.04, 0.1, -0.05, 0.08;
  Rigid3d pose = Perturb(world.T_camera_map[2], delta);
  const int inliers = OptimizePose(world.camera, observations, pose);
  EXPECT_NEAR(inliers, static_cast<int>(observations.size() - outliers), 3);
  EXPECT_LT((pose.translation - world.T_camera_map[2].translation).norm(), 1e-6);
  EXPECT_LT(pose.rotation.angularDistance(world.T_camera_map[2].rotation), 1e-6);
  for (std::size_t i = outliers; i < observations.size(); ++i) {
    EXPECT_TRUE(observations[i].inlier);
  }
}

TEST(OptimizePose, ReportsNoInliersWhenNothingFits) {
  const SyntheticMap world = MakeSyntheticMap({});
  std::vector<PointObservation> observations = ObservationsOf(world, 0);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> pixel(0.0, 480.0);
  for (PointObservation& o : observations) {
    o.pixel = {pixel(random), pixel(random)};
  }
  Rigid3d pose = world.T_camera_map[0];
  EXPECT_LT(OptimizePose(world.camera, observations, pose), 20);
}

TEST(Triangulate, ReturnsExactPointWithoutNoise) {
  const SyntheticMap world = MakeSyntheticMap({});
  for (const Eigen::Vector3d& p : world.points) {
    const Eigen::Vector3d c1 = world.T_camera_map[0] * p;
    const Eigen::Vector3d c2 = world.T_camera_map[5] * p;
    const Eigen::Vector3d found =
        Triangulate(world.T_camera_map[0], c1 / c1.z(), world.T_camera_map[5], c2 / c2.z());
    EXPECT_LT((found - p).norm(), 1e-8);
  }
}

}  // namespace
}  // namespace sqslam
