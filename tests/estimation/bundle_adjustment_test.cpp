#include "slam/estimation/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <ranges>

#include "slam/estimation/reprojection_cost.h"
#include "slam/util/to_vector.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::SyntheticMap;

// Central differences over the manifold's own Plus: the Jacobians that the solver sees.
TEST(ReprojectionCost, JacobiansAgreeWithNumericOnes) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 3, .points = 5});
  const PoseManifold manifold;
  constexpr double kStep = 1e-6;
  for (const Eigen::Vector3d& p : world.points) {
    const ReprojectionCost cost({world.camera, {300.0, 200.0}, 1.44});
    const PoseBlock pose = ToBlock(world.T_camera_map[2]);
    const auto evaluate = [&](const double* pose_block, const Eigen::Vector3d& point) {
      const double* parameters[] = {pose_block, point.data()};
      Eigen::Vector2d residual;
      EXPECT_TRUE(cost.Evaluate(parameters, residual.data(), nullptr));
      return residual;
    };
    Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point;
    double* jacobians[] = {J_pose.data(), J_point.data()};
    const double* parameters[] = {pose.data(), p.data()};
    Eigen::Vector2d residual;
    ASSERT_TRUE(cost.Evaluate(parameters, residual.data(), jacobians));
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
    manifold.PlusJacobian(pose.data(), plus.data());
    const Eigen::Matrix<double, 2, 6> tangent = J_pose * plus;
    for (int i = 0; i < 6; ++i) {
      Vector6d delta = Vector6d::Zero();
      PoseBlock forward;
      PoseBlock backward;
      delta[i] = kStep;
      manifold.Plus(pose.data(), delta.data(), forward.data());
      delta[i] = -kStep;
      manifold.Plus(pose.data(), delta.data(), backward.data());
      const Eigen::Vector2d numeric =
          (evaluate(forward.data(), p) - evaluate(backward.data(), p)) / (2.0 * kStep);
      EXPECT_LT((numeric - tangent.col(i)).norm(), 1e-4 * (1.0 + numeric.norm()));
    }
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
      const Eigen::Vector2d numeric =
          (evaluate(pose.data(), p + step) - evaluate(pose.data(), p - step)) / (2.0 * kStep);
      EXPECT_LT((numeric - J_point.col(i)).norm(), 1e-4 * (1.0 + numeric.norm()));
    }
  }
}

TEST(PoseManifold, MinusUndoesPlus) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 2, .points = 2});
  const PoseManifold manifold;
  const PoseBlock x = ToBlock(world.T_camera_map[1]);
  Vector6d delta;
  delta << 0.1, -0.2, 0.05, 1.0, 2.0, -0.3;
  PoseBlock y;
  manifold.Plus(x.data(), delta.data(), y.data());
  Vector6d found;
  manifold.Minus(y.data(), x.data(), found.data());
  EXPECT_TRUE(found.isApprox(delta, 1e-9));
}

void Disturb(SyntheticMap& world, double amount) {
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, amount);
  for (KeyframeId id = 2; id < static_cast<KeyframeId>(world.T_camera_map.size()); ++id) {
    Vector6d delta;
    for (int i = 0; i < 6; ++i) {
      delta[i] = noise(random);
    }
    world.map.At(id).T_camera_map = Perturb(world.map.At(id).T_camera_map, delta);
  }
  for (const MapPoint& point : world.map.Points()) {
    world.map.Point(point.id).p_map += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
}

TEST(LocalBundleAdjustment, RestoresPosesAndPoints) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world, 0.005);
  BundleAdjustmentOptions options;
  options.iterations = 20;
  const BundleAdjustmentReport report = LocalBundleAdjustment(
      world.map, world.camera, LocalWindow(world.map, 5, options.max_keyframes), options, {});
  EXPECT_FALSE(report.interrupted);
  for (const auto& [id, keyframe] : world.map.Keyframes()) {
    EXPECT_LT(
        (keyframe.T_camera_map.translation - world.T_camera_map[static_cast<std::size_t>(id)].translation)
            .norm(),
        1e-4);
  }
  for (const MapPoint& point : world.map.Points()) {
    EXPECT_LT((point.p_map - world.points[static_cast<std::size_t>(point.id)]).norm(), 1e-3);
  }
}

TEST(LocalBundleAdjustment, EndsAtCostTolerance) {
  const auto error_with = [](double cost_tolerance) {
    SyntheticMap world = MakeSyntheticMap({});
    Disturb(world, 0.005);
    BundleAdjustmentOptions options;
    options.iterations = 20;
    options.cost_tolerance = cost_tolerance;
    LocalBundleAdjustment(world.map, world.camera, LocalWindow(world.map, 5, options.max_keyframes), options,
                          {});
    double sum = 0.0;
    for (const MapPoint& point : world.map.Points()) {
      sum += (point.p_map - world.points[static_cast<std::size_t>(point.id)]).norm();
    }
    return sum;
  };
  EXPECT_GT(error_with(1.0), 2.0 * error_with(1e-5));
}

TEST(LocalBundleAdjustment, RemovesWrongObservations) {
  SyntheticMap world = MakeSyntheticMap({});
  // Two points trade places in one keyframe.
  Map& map = world.map;
  map.RemoveObservation(10, 4);
  map.RemoveObservation(20, 4);
  map.AddObservation(10, 4, 20);
  map.AddObservation(20, 4, 10);
  LocalBundleAdjustment(map, world.camera, LocalWindow(map, 5, BundleAdjustmentOptions{}.max_keyframes), {},
                        {});
  EXPECT_EQ(map.At(4).points[10], kNoPoint);
  EXPECT_EQ(map.At(4).points[20], kNoPoint);
  EXPECT_TRUE(map.IsAlive(10));
  EXPECT_EQ(CountBrokenReferences(map), 0);
}

TEST(LocalBundleAdjustment, StopsWhenInterrupted) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world, 0.01);
  EXPECT_TRUE(LocalBundleAdjustment(world.map, world.camera,
                                    LocalWindow(world.map, 5, BundleAdjustmentOptions{}.max_keyframes), {},
                                    [] { return true; })
                  .interrupted);
}

// Distances between points, which no choice of the map frame changes, against the truth in the unit of length
// that fits best.
double ShapeError(const SyntheticMap& world) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i + 1 < world.points.size(); ++i) {
    ratios.push_back(
        (world.map.Point(static_cast<PointId>(i)).p_map - world.map.Point(static_cast<PointId>(i + 1)).p_map)
            .norm() /
        (world.points[i] - world.points[i + 1]).norm());
  }
  double mean = 0.0;
  for (const double ratio : ratios) {
    mean += ratio / static_cast<double>(ratios.size());
  }
  double squared = 0.0;
  for (const double ratio : ratios) {
    squared += (ratio / mean - 1.0) * (ratio / mean - 1.0);
  }
  return std::sqrt(squared / static_cast<double>(ratios.size()));
}

// Frames between the keyframes that see every point, a tenth of them, each time another, where they are not.
std::vector<BundleFrame> NoisyFrames(const SyntheticMap& world, int count) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.5);
  std::vector<BundleFrame> frames;
  for (int k = 0; k < count; ++k) {
    BundleFrame frame{PoseOnArc(5.0 * (k + 0.5) / count), {}};
    for (std::size_t i = 0; i < world.points.size(); ++i) {
      const Eigen::Vector2d wrong = (i + static_cast<std::size_t>(k)) % 10 == 0 ? Eigen::Vector2d(40.0, -25.0)
                                                                                : Eigen::Vector2d(0.0, 0.0);
      frame.matches.push_back({static_cast<PointId>(i),
                               world.camera.Project(frame.T_camera_map * world.points[i]) + wrong +
                                   Eigen::Vector2d(noise(random), noise(random)),
                               1.0});
    }
    frame.T_camera_map.translation.x() += 0.01;
    frame.matches.push_back({1000000, {10.0, 10.0}, 1.0});  // a point that is gone
    frames.push_back(std::move(frame));
  }
  return frames;
}

TEST(GlobalBundleAdjustment, FramesBetweenKeyframesImprovePoints) {
  SyntheticMap alone = MakeSyntheticMap({.pixel_noise = 0.5});
  SyntheticMap helped = MakeSyntheticMap({.pixel_noise = 0.5});
  GlobalBundleAdjustment(alone.map, alone.camera, 30);
  GlobalBundleAdjustment(helped.map, helped.camera, 30, {}, NoisyFrames(helped, 40));
  EXPECT_LT(ShapeError(helped), 0.6 * ShapeError(alone));
  EXPECT_EQ(helped.map.Keyframes().size(), alone.map.Keyframes().size());
  EXPECT_EQ(CountBrokenReferences(helped.map), 0);
  for (const MapPoint& point : helped.map.Points()) {  // frames' outliers cost the map nothing
    EXPECT_GE(point.observations.size(), 5U) << point.id;
  }
}

// Keypoints of all keyframes but the last are aligned; one in ten of keyframe 1 lies `miss` px off.
SyntheticMap PartlyAligned(const Eigen::Vector2d& miss) {
  SyntheticMap world = MakeSyntheticMap({});
  for (const KeyframeId id : ToVector(world.map.Keyframes() | std::views::keys)) {
    auto features = std::make_shared<FrameFeatures>(*world.map.At(id).features);
    for (std::size_t i = 0; i < features->Size(); ++i) {
      features->keypoints[i].sigma = id == world.map.NewestKeyframe() ? 1.0F : 0.3F;
      features->keypoints[i].pixel += id == 1 && i % 10 == 0 ? miss : Eigen::Vector2d(0.0, 0.0);
    }
    world.map.At(id).features = features;
  }
  return world;
}

TEST(ExtractBundleProblem, TakesSigmaOfAlignedKeypoints) {
  const SyntheticMap world = PartlyAligned({0.0, 0.0});
  const BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  for (const BundleObservation& o : problem.observations) {
    const double share = problem.poses[o.pose].id == world.map.NewestKeyframe() ? 1.0 : 0.3;
    EXPECT_NEAR(o.sigma, share * o.detected_sigma, 1e-6);
  }
}

TEST(GlobalBundleAdjustment, KeepsAlignedKeypointsUpToErrorOfDetectedOnes) {
  const auto observations = [](const Eigen::Vector2d& miss) {
    SyntheticMap world = PartlyAligned(miss);
    GlobalBundleAdjustment(world.map, world.camera, 30);
    return std::ranges::distance(world.map.At(1).SeenPoints());
  };
  const auto all = observations({0.0, 0.0});
  EXPECT_EQ(observations({1.5, 0.0}), all);  // five standard deviations once aligned
  EXPECT_LT(observations({6.0, 0.0}), all);
}

TEST(GlobalBundleAdjustment, ReducesErrorAndHoldsFirstKeyframe) {
  SyntheticMap world = MakeSyntheticMap({.pixel_noise = 0.5});
  Disturb(world, 0.01);
  GlobalBundleAdjustment(world.map, world.camera, 30);
  EXPECT_TRUE(world.map.At(0).T_camera_map.Matrix().isApprox(world.T_camera_map[0].Matrix()));
  double squared = 0.0;
  int count = 0;
  for (const MapPoint& point : world.map.Points()) {
    for (const Observation& o : point.observations) {
      const Keyframe& keyframe = world.map.At(o.keyframe);
      squared += (world.camera.Project(keyframe.T_camera_map * point.p_map) -
                  keyframe.features->keypoints[static_cast<std::size_t>(o.keypoint)].pixel)
                     .squaredNorm();
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squared / count), 0.75);  // noise of 0.5 px in x and y
}

TEST(SolveBundle, KeepsMapUntilApplied) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world, 0.005);
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  EXPECT_EQ(problem.poses.size(), 6U);
  EXPECT_EQ(problem.observations.size(), 6U * 300U);
  const Eigen::Matrix4d before = world.map.At(4).T_camera_map.Matrix();
  EXPECT_TRUE(SolveBundle(problem, {20, 20}, {}));
  EXPECT_EQ(world.map.At(4).T_camera_map.Matrix(), before);
  ApplyBundle(problem, world.map);
  EXPECT_EQ(world.map.At(4).T_camera_map.Matrix(), problem.poses[4].T_camera_map.Matrix());
  EXPECT_EQ(world.map.Point(7).p_map, problem.points[7].p_map);
}

TEST(SolveBundle, StopsAfterIterationAndKeepsState) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world, 0.01);
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  const Eigen::Matrix4d before = problem.poses[4].T_camera_map.Matrix();
  int asked = 0;
  EXPECT_FALSE(SolveBundle(problem, {20, 20}, [&] { return ++asked == 3; }));
  EXPECT_EQ(asked, 3);
  EXPECT_NE(problem.poses[4].T_camera_map.Matrix(), before);
}

TEST(SolveBundle, RepeatsToTheLastBit) {
  SyntheticMap world = MakeSyntheticMap({.pixel_noise = 0.5});
  Disturb(world, 0.01);
  BundleProblem first = ExtractBundleProblem(world.map, world.camera);
  BundleProblem second = first;
  SolveBundle(first, {}, {});
  SolveBundle(second, {}, {});
  for (std::size_t i = 0; i < first.poses.size(); ++i) {
    EXPECT_EQ(first.poses[i].T_camera_map.Matrix(), second.poses[i].T_camera_map.Matrix());
  }
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    EXPECT_EQ(first.points[i].p_map, second.points[i].p_map);
  }
}

TEST(SolveBundle, KeepsPointSeenElsewhereDespiteOutliers) {
  SyntheticMap world = MakeSyntheticMap({});
  // Keyframes 4 and 5 look at the wrong place for points 10 and 20; 0 to 3 are not part of the problem.
  for (const KeyframeId id : {4, 5}) {
    world.map.RemoveObservation(10, id);
    world.map.RemoveObservation(20, id);
    world.map.AddObservation(10, id, 20);
    world.map.AddObservation(20, id, 10);
  }
  for (const KeyframeId id : {0, 1, 2}) {
    world.map.RemoveObservation(20, id);  // seen elsewhere once only
  }
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera, {5}, {4});
  EXPECT_EQ(problem.points[10].seen_elsewhere, 4);
  EXPECT_EQ(problem.points[20].seen_elsewhere, 1);
  for (BundleObservation& o : problem.observations) {
    o.sigma = o.point == 10 || o.point == 20 ? 1e-3 : 1.0;  // nothing fits these two
  }
  SolveBundle(problem, {1, 1}, {});
  EXPECT_TRUE(problem.points[10].alive);
  EXPECT_FALSE(problem.points[20].alive);
}

TEST(ApplyBundle, AcceptsMapThatHasChanged) {
  SyntheticMap world = MakeSyntheticMap({});
  Disturb(world, 0.005);
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera);
  SolveBundle(problem, {20, 20}, {});
  problem.observations[0].inlier = false;          // point 0 in keyframe 0
  problem.observations[3 * 6 + 1].inlier = false;  // point 3 in keyframe 1
  world.map.RemoveKeyframe(3);
  world.map.RemovePoint(0);
  world.map.Fuse(5, 6);
  EXPECT_EQ(ApplyBundle(problem, world.map), 2);
  EXPECT_EQ(CountBrokenReferences(world.map), 0);
  EXPECT_FALSE(world.map.IsAlive(0));
  EXPECT_EQ(world.map.At(1).points[3], kNoPoint);
  EXPECT_EQ(world.map.At(4).T_camera_map.Matrix(), problem.poses[4].T_camera_map.Matrix());
}

}  // namespace
}  // namespace sqslam
