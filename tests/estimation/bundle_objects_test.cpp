#include "slam/estimation/bundle_objects.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/geometry/lie.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

PosedSuperquadric PlantedObject() {
  PosedSuperquadric object;
  object.shape = {{0.20, 0.12, 0.30}, 0.35, 0.6};
  object.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())),
                         {0.05, -0.03, 0.1}};
  return object;
}

PosedSuperquadric WrongStart() {
  PosedSuperquadric start = PlantedObject();
  start.shape.half_size = start.shape.half_size.cwiseProduct(Eigen::Vector3d(1.12, 0.9, 0.93));
  start.shape.e1 = 1.0;
  start.shape.e2 = 1.0;
  start.T_map_object.translation += Eigen::Vector3d(0.015, -0.01, 0.02);
  start.T_map_object.rotation =
      start.T_map_object.rotation * Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitZ());
  return start;
}

constexpr std::size_t kObjectPoints = 200;

struct PlantedScene {
  std::vector<Rigid3d> T_camera_map;  // exact
  std::vector<Eigen::Vector3d> points;
  BundleProblem problem;  // noisy, the first two cameras fixed and exact
};

// Eight cameras around an object, whose points come first, and a cloud about it; 1 px of noise.
PlantedScene MakePlantedScene(unsigned seed = 3) {
  PlantedScene scene;
  scene.problem.camera = {.width = 640, .height = 480, .fx = 500.0, .fy = 500.0, .cx = 320.0, .cy = 240.0};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 1.0);
  const PosedSuperquadric object = PlantedObject();
  for (std::size_t i = 0; i < 320; ++i) {
    const Eigen::Vector3d direction(uniform(random), uniform(random), uniform(random));
    scene.points.push_back(
        i < kObjectPoints
            ? Eigen::Vector3d(object.T_map_object * (direction / object.shape.RadialScale(direction)))
            : Eigen::Vector3d(1.2 * direction));
  }
  for (int i = 0; i < 8; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 8.0;
    const Eigen::Vector3d centre(2.5 * std::cos(angle), 2.5 * std::sin(angle), 0.8);
    Eigen::Matrix3d R_map_camera;
    R_map_camera.col(2) = -centre.normalized();
    R_map_camera.col(0) = R_map_camera.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
    R_map_camera.col(1) = R_map_camera.col(2).cross(R_map_camera.col(0));
    scene.T_camera_map.push_back(Rigid3d{Eigen::Quaterniond(R_map_camera), centre}.Inverse());
    Vector6d delta = Vector6d::Zero();
    for (int k = 0; k < 6 && i >= 2; ++k) {
      delta[k] = 0.003 * noise(random);
    }
    scene.problem.poses.push_back({i, i < 2, Perturb(scene.T_camera_map.back(), delta)});
  }
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Eigen::Vector3d p =
        scene.points[i] + 0.005 * Eigen::Vector3d(noise(random), noise(random), noise(random));
    scene.problem.points.push_back({static_cast<PointId>(i), p, 0, true});
    for (std::size_t k = 0; k < scene.T_camera_map.size(); ++k) {
      const Eigen::Vector2d pixel = scene.problem.camera.Project(scene.T_camera_map[k] * scene.points[i]);
      scene.problem.observations.push_back(
          {k, i, pixel + Eigen::Vector2d(noise(random), noise(random)), 1.0, true});
    }
  }
  return scene;
}

BundleObject WrongObject() {
  BundleObject object;
  object.id = 4;
  object.superquadric = WrongStart();
  object.sigma = 0.01 * object.superquadric.shape.half_size.mean();
  object.prior = 1.0;
  for (std::size_t i = 0; i < kObjectPoints; ++i) {
    object.points.push_back({i, 1.0});
  }
  return object;
}

double PointError(const PlantedScene& scene, const BundleProblem& problem) {
  double squared = 0.0;
  for (std::size_t i = 0; i < kObjectPoints; ++i) {
    squared += (problem.points[i].p_map - scene.points[i]).squaredNorm();
  }
  return std::sqrt(squared / kObjectPoints);
}

double PoseError(const PlantedScene& scene, const BundleProblem& problem) {
  double squared = 0.0;
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    squared += (problem.poses[i].T_camera_map.translation - scene.T_camera_map[i].translation).squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(problem.poses.size()));
}

TEST(SurfaceCost, EqualsWeightedRadialDistanceWhenTurned) {
  const PosedSuperquadric object = PlantedObject();
  const SurfaceCost cost{object.T_map_object.RotationMatrix().transpose(), 3.0};
  for (const double turn : {0.0, 0.7}) {
    SuperquadricBlock block = ToBlock(object);
    block[kBlockTurn] = turn;
    const PosedSuperquadric turned = FromBlock(block, object.T_map_object.rotation);
    EXPECT_NEAR(turned.T_map_object.rotation.angularDistance(object.T_map_object.rotation), turn, 1e-7);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.3, -0.2, 0.25), Eigen::Vector3d(0.1, 0.0, 0.15)}) {
      Eigen::Vector2d residuals;
      ASSERT_TRUE(cost(block.data(), p.data(), residuals.data()));
      EXPECT_NEAR(residuals[0], 3.0 * turned.shape.RadialDistance(turned.T_map_object.Inverse() * p), 1e-6);
      EXPECT_EQ(residuals[1], 0.0);
    }
  }
}

TEST(JointBundle, RecoversShapeAndImprovesPoints) {
  const PlantedScene scene = MakePlantedScene();
  BundleProblem alone = scene.problem;
  BundleProblem joint = scene.problem;
  joint.objects.push_back(WrongObject());
  const double cost_before = ShapeCost(joint.objects[0], joint);
  ASSERT_TRUE(SolveBundle(alone, {20, 20}, {}));
  ASSERT_TRUE(SolveBundle(joint, {20, 20}, {}));
  const PosedSuperquadric truth = PlantedObject();
  const PosedSuperquadric& found = joint.objects[0].superquadric;
  EXPECT_TRUE(joint.objects[0].improved);
  EXPECT_LT(ShapeCost(joint.objects[0], joint), 0.1 * cost_before);
  EXPECT_LT((found.T_map_object.translation - truth.T_map_object.translation).norm(), 0.004);
  EXPECT_LT((found.shape.half_size - truth.shape.half_size).cwiseAbs().maxCoeff(), 0.006);
  EXPECT_NEAR(found.shape.e1, truth.shape.e1, 0.1);
  EXPECT_NEAR(found.shape.e2, truth.shape.e2, 0.1);
  EXPECT_LT(found.T_map_object.rotation.angularDistance(truth.T_map_object.rotation), 0.02);
  EXPECT_LT(PointError(scene, joint), 0.9 * PointError(scene, alone));
}

TEST(JointBundle, KeepsFixedPoses) {
  double alone_error = 0.0;
  double joint_error = 0.0;
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U}) {
    const PlantedScene scene = MakePlantedScene(seed);
    BundleProblem alone = scene.problem;
    BundleProblem joint = scene.problem;
    joint.objects.push_back(WrongObject());
    SolveBundle(alone, {20, 20}, {});
    SolveBundle(joint, {20, 20}, {});
    for (const std::size_t fixed : {0U, 1U}) {
      EXPECT_EQ(joint.poses[fixed].T_camera_map.Matrix(), scene.problem.poses[fixed].T_camera_map.Matrix());
    }
    alone_error += PoseError(scene, alone);
    joint_error += PoseError(scene, joint);
  }
  EXPECT_LT(joint_error, 1.05 * alone_error);
}

TEST(JointBundle, KeepsPointsWhenSurfaceIsWrong) {
  const PlantedScene scene = MakePlantedScene();
  BundleProblem alone = scene.problem;
  BundleProblem joint = scene.problem;
  BundleObject object = WrongObject();
  object.sigma = 0.1 * object.superquadric.shape.half_size.mean();
  object.superquadric.shape.half_size *= 1.5;
  object.prior = 0.001;  // and it is sure of itself
  joint.objects.push_back(object);
  SolveBundle(alone, {20, 20}, {});
  SolveBundle(joint, {20, 20}, {});
  EXPECT_LT(PointError(scene, joint), 1.2 * PointError(scene, alone));
}

TEST(JointBundle, KeepsShapeWhenInterrupted) {
  BundleProblem problem = MakePlantedScene().problem;
  problem.objects.push_back(WrongObject());
  SolveBundle(problem, {20, 20}, [] { return true; });
  EXPECT_FALSE(problem.objects[0].improved);
  EXPECT_EQ(problem.objects[0].superquadric.shape.half_size, WrongStart().shape.half_size);
  EXPECT_EQ(problem.objects[0].superquadric.T_map_object.Matrix(), WrongStart().T_map_object.Matrix());
}

TEST(JointBundle, KeepsExponentsWithinTheirBounds) {
  BundleProblem problem = MakePlantedScene().problem;
  BundleObject object = WrongObject();
  object.superquadric.shape.e1 = kMinShapeExponent;
  object.superquadric.shape.e2 = kMaxShapeExponent;
  problem.objects.push_back(object);
  SolveBundle(problem, {20, 20}, {});
  const Superquadric& shape = problem.objects[0].superquadric.shape;
  for (const double e : {shape.e1, shape.e2}) {
    EXPECT_GE(e, kMinShapeExponent);
    EXPECT_LE(e, kMaxShapeExponent);
  }
}

TEST(JointBundle, RepeatsToTheLastBit) {
  BundleProblem first = MakePlantedScene().problem;
  first.objects.push_back(WrongObject());
  BundleProblem second = first;
  SolveBundle(first, {}, {});
  SolveBundle(second, {}, {});
  for (std::size_t i = 0; i < first.poses.size(); ++i) {
    EXPECT_EQ(first.poses[i].T_camera_map.Matrix(), second.poses[i].T_camera_map.Matrix());
  }
  EXPECT_EQ(ToBlock(first.objects[0].superquadric), ToBlock(second.objects[0].superquadric));
}

TEST(AddObjects, SeparatesVariableFromHeldPoints) {
  testing::SyntheticMap world = testing::MakeSyntheticMap({});
  world.map.RemoveObservation(11, 5);  // keyframe 5 alone is free
  const std::vector<ObjectTerm> terms{{7, PlantedObject(), {10, 11, 12}, {0.5, 0.25, 1.0}},
                                      {8, PlantedObject(), {11, 13}, {1.0, 1.0}}};
  BundleProblem problem = ExtractBundleProblem(world.map, world.camera, {5}, {4});
  AddObjects(terms, {.min_points = 2}, world.map, problem);
  ASSERT_EQ(problem.objects.size(), 1U);  // of the other one point is left
  const BundleObject& object = problem.objects[0];
  EXPECT_EQ(object.id, 7);
  EXPECT_NEAR(object.sigma, 0.1 * (0.20 + 0.12 + 0.30) / 3.0, 1e-12);
  ASSERT_EQ(object.points.size(), 2U);
  EXPECT_EQ(problem.points[object.points[1].index].id, 12);
  EXPECT_EQ(object.points[1].weight, 1.0);
  ASSERT_EQ(object.held_points.size(), 1U);
  EXPECT_EQ(object.held_points[0].p_map, world.map.Point(11).p_map);
  EXPECT_EQ(object.held_points[0].weight, 0.25);
}

TEST(AddObjects, ChangesNothingWithoutObject) {
  BundleProblem alone = MakePlantedScene().problem;
  BundleProblem joint = alone;
  const std::vector<ObjectTerm> terms{{7, PlantedObject(), {0, 1}, {1.0, 1.0}}};
  AddObjects(terms, {.min_points = 3}, testing::MakeSyntheticMap({}).map, joint);
  SolveBundle(alone, {}, {});
  SolveBundle(joint, {}, {});
  for (std::size_t i = 0; i < alone.points.size(); ++i) {
    EXPECT_EQ(alone.points[i].p_map, joint.points[i].p_map);
  }
}

}  // namespace
}  // namespace sqslam
