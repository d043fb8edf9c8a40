#include "slam/estimation/camera_learning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "slam/estimation/reprojection_cost.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::SyntheticMap;

TEST(CameraReprojectionCost, JacobiansAgreeWithNumericOnes) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 3, .points = 5});
  constexpr double kStep = 1e-6;
  Camera fisheye = world.camera;
  fisheye.lens = LensModel::kFisheye;
  for (std::size_t at = 0; at < 2 * world.points.size(); ++at) {
    const Eigen::Vector3d& p = world.points[at / 2];
    const CameraReprojectionCost cost(at % 2 == 0 ? world.camera : fisheye, {300.0, 200.0}, 1.44,
                                      {30.0, -20.0});
    const PoseBlock pose = ToBlock(world.T_camera_map[2]);
    const CameraBlock camera{0.1, -0.2, 0.05, 3.0, -4.0, 0.01};
    const auto evaluate = [&](const Eigen::Vector3d& point, const CameraBlock& block) {
      const double* parameters[] = {pose.data(), point.data(), block.data()};
      Eigen::Vector2d residual;
      EXPECT_TRUE(cost.Evaluate(parameters, residual.data(), nullptr));
      return residual;
    };
    Eigen::Matrix<double, 2, 7, Eigen::RowMajor> J_pose;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> J_point;
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> J_camera;
    double* jacobians[] = {J_pose.data(), J_point.data(), J_camera.data()};
    const double* parameters[] = {pose.data(), p.data(), camera.data()};
    Eigen::Vector2d residual;
    ASSERT_TRUE(cost.Evaluate(parameters, residual.data(), jacobians));
    // A point moved in the camera frame moves the pixel as the pose's translation does.
    const Eigen::Matrix3d R = FromBlock(pose.data()).rotation.toRotationMatrix();
    EXPECT_TRUE(J_point.isApprox(J_pose.middleCols<3>(3) * R, 1e-9));
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
      const Eigen::Vector2d numeric =
          (evaluate(p + step, camera) - evaluate(p - step, camera)) / (2.0 * kStep);
      EXPECT_LT((numeric - J_point.col(i)).norm(), 1e-4 * (1.0 + numeric.norm()));
    }
    for (std::size_t i = 0; i < camera.size(); ++i) {
      CameraBlock more = camera;
      CameraBlock less = camera;
      more[i] += kStep;
      less[i] -= kStep;
      const Eigen::Vector2d numeric = (evaluate(p, more) - evaluate(p, less)) / (2.0 * kStep);
      EXPECT_LT((numeric - J_camera.col(static_cast<int>(i))).norm(), 1e-4 * (1.0 + numeric.norm()));
    }
  }
}

bool Holds(const LearntCamera& learnt, double focal) {
  const auto [low, high] = FocalInterval(learnt.focal, learnt.deviation);
  return low <= focal && focal <= high;
}

Camera Longer(Camera camera, double factor) {
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

TEST(LearnCamera, FindsFocalLength) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 12, .points = 400, .pixel_noise = 0.3});
  const LearntCamera learnt =
      LearnCamera(world.map, Longer(world.camera, 1.12), {.what = LearntPart::kFocal});
  ASSERT_TRUE(learnt.trusted);
  EXPECT_NEAR(learnt.camera.fx, world.camera.fx, 0.01 * world.camera.fx);
  EXPECT_TRUE(Holds(learnt, world.camera.fx));
  EXPECT_EQ(learnt.camera.distortion[0], 0.0);
}

TEST(LearnCamera, FindsNoDistortionWithoutAny) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 12, .points = 400, .pixel_noise = 0.3});
  const LearntCamera learnt = LearnCamera(world.map, world.camera, {.what = LearntPart::kFocalAndRadial});
  EXPECT_NEAR(learnt.camera.distortion[0], 0.0, 0.02);
}

// Wide cameras, assumed to have no distortion and another focal length.
TEST(LearnCamera, FindsCoefficientsOfLens) {
  for (const auto& [lens, k1, k2] : {std::tuple(LensModel::kRadialTangential, -0.28, 0.07),
                                     std::tuple(LensModel::kFisheye, 0.03, -0.01)}) {
    Camera camera{640, 480, 250.0, 250.0, 319.5, 239.5, {k1, k2}};
    camera.lens = lens;
    SyntheticMap world = MakeSyntheticMap(
        {.keyframes = 8, .points = 400, .pixel_noise = 0.3, .half_extent = 2.5, .camera = camera});
    Camera assumed = Longer(camera, 1.06);
    assumed.distortion = {};
    const LearntCamera learnt = LearnCamera(world.map, assumed, {.what = LearntPart::kFocalAndRadial});
    EXPECT_NEAR(learnt.camera.fx, 250.0, 2.5);
    EXPECT_NEAR(learnt.camera.distortion[0], k1, 0.01);
    EXPECT_NEAR(learnt.camera.distortion[1], k2, 0.01);
    EXPECT_LT(learnt.mean_squared_error, 0.3);
  }
}

// The same lens, assumed to be of the other kind, leaves larger errors.
TEST(LearnCamera, LeavesLargerErrorsWithWrongLens) {
  Camera fisheye{512, 512, 189.0, 189.0, 255.5, 255.5};
  fisheye.lens = LensModel::kFisheye;
  const auto error_with = [&](LensModel lens) {
    SyntheticMap world = MakeSyntheticMap(
        {.keyframes = 8, .points = 400, .pixel_noise = 0.3, .half_extent = 3.2, .camera = fisheye});
    Camera assumed = fisheye;
    assumed.lens = lens;
    return LearnCamera(world.map, assumed, {.what = LearntPart::kFocalAndRadial}).mean_squared_error;
  };
  EXPECT_GT(error_with(LensModel::kRadialTangential), 1.5 * error_with(LensModel::kFisheye));
}

TEST(LearnCamera, HoldsTrueFocalLengthInInterval) {
  int held = 0;
  constexpr int kMaps = 20;
  for (int i = 0; i < kMaps; ++i) {
    SyntheticMap world = MakeSyntheticMap(
        {.keyframes = 6, .points = 60, .pixel_noise = 1.0, .seed = 100 + static_cast<std::uint64_t>(i)});
    held += Holds(LearnCamera(world.map, Longer(world.camera, 1.05), {.what = LearntPart::kFocal}),
                  world.camera.fx)
                ? 1
                : 0;
  }
  EXPECT_GE(held, 18);
}

TEST(LearnCamera, WidensWithFewNoisyPoints) {
  SyntheticMap good = MakeSyntheticMap({.keyframes = 12, .points = 400, .pixel_noise = 0.3});
  SyntheticMap poor = MakeSyntheticMap({.keyframes = 4, .points = 30, .pixel_noise = 1.5});
  EXPECT_GT(LearnCamera(poor.map, poor.camera, {.what = LearntPart::kFocal}).deviation,
            2.0 * LearnCamera(good.map, good.camera, {.what = LearntPart::kFocal}).deviation);
}

TEST(LearnCamera, KeepsAssumedCameraWhenDeviationIsTooLarge) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 12, .points = 400, .pixel_noise = 0.3});
  const LearntCamera learnt =
      LearnCamera(world.map, world.camera, {.what = LearntPart::kFocal, .max_deviation = 0.0});
  EXPECT_FALSE(learnt.trusted);
  EXPECT_EQ(learnt.camera.fx, world.camera.fx);
  EXPECT_GT(learnt.deviation, 0.0);
}

constexpr FocalEstimate kPrior{0.0, 0.3};

TEST(CombineEstimates, WidensWhenHalvesDisagree) {
  const FocalEstimate whole{0.05, 0.005};
  const FocalEstimate agreeing =
      CombineEstimates(whole, {FocalEstimate{0.045, 0.007}, FocalEstimate{0.055, 0.007}}, kPrior);
  const FocalEstimate disagreeing =
      CombineEstimates(whole, {FocalEstimate{0.0, 0.007}, FocalEstimate{0.1, 0.007}}, kPrior);
  EXPECT_LT(agreeing.deviation, 0.02);
  EXPECT_GT(disagreeing.deviation, 0.045);  // both halves are inside two deviations
}

TEST(CombineEstimates, FallsBackToPriorWithoutEvidence) {
  const FocalEstimate nothing{0.7, 5.0};
  const FocalEstimate combined = CombineEstimates(nothing, {nothing, nothing}, kPrior);
  EXPECT_NEAR(combined.log_change, kPrior.log_change, 0.01);
  EXPECT_NEAR(combined.deviation, kPrior.deviation, 0.01);
}

TEST(CombineEstimates, DistrustsLargeChange) {
  const std::array halves = {FocalEstimate{0.4, 0.001}, FocalEstimate{0.4, 0.001}};
  EXPECT_GT(CombineEstimates({0.4, 0.001}, halves, kPrior).deviation, 0.05);
}

}  // namespace
}  // namespace sqslam
