#include "slam/estimation/sim3_estimation.h"

#include <gtest/gtest.h>

#include <random>

#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

const Camera kCamera{640, 480, 500.0, 510.0, 320.0, 240.0, {}, 30.0};

// The second camera's map is 1.7 times smaller; between the cameras lie 20 degrees and half a unit.
const Sim3d kTruth{1.7,
                   Eigen::Quaterniond(Eigen::AngleAxisd(0.35, Eigen::Vector3d(0.2, 1.0, 0.1).normalized())),
                   {-1.2, 0.1, 0.4}};

struct PairOptions {
  int matches = 100;
  double outlier_share = 0.0;
  double pixel_noise = 0.0;  // px, standard deviation
  double depth_noise = 0.0;  // of the map points along their rays, relative standard deviation
};

// Points 3 to 6 units in front of the first camera; outliers come first and have a random second point.
std::vector<Sim3Match> MakePair(const PairOptions& options) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> x(0.0, 640.0);
  std::uniform_real_distribution<double> y(0.0, 480.0);
  std::uniform_real_distribution<double> depth(3.0, 6.0);
  std::normal_distribution<double> normal;
  const auto random_point = [&] {
    return Eigen::Vector3d(depth(random) * kCamera.Unproject({x(random), y(random)}));
  };
  const auto noisy_pixel = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector2d(kCamera.Project(p) +
                           options.pixel_noise * Eigen::Vector2d(normal(random), normal(random)));
  };
  std::vector<Sim3Match> matches;
  for (int i = 0; i < options.matches; ++i) {
    Sim3Match match;
    match.p_camera1 = random_point();
    match.p_camera2 = kTruth.Inverse() * match.p_camera1;
    if (i < options.outlier_share * options.matches) {
      match.p_camera2 = random_point();
    }
    match.pixel1 = noisy_pixel(match.p_camera1);
    match.pixel2 = noisy_pixel(match.p_camera2);
    match.p_camera1 *= 1.0 + options.depth_noise * normal(random);
    match.p_camera2 *= 1.0 + options.depth_noise * normal(random);
    matches.push_back(match);
  }
  return matches;
}

// Norm of the tangent vector from one similarity to the other.
double Distance(const Sim3d& a, const Sim3d& b) { return LogSim3(a * b.Inverse()).norm(); }

TEST(EstimateSim3, FindsSimilarityAmongOutliers) {
  const std::vector<Sim3Match> matches = MakePair({.matches = 200, .outlier_share = 0.6});
  const std::optional<Sim3Estimate> found = EstimateSim3(kCamera, matches);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(Distance(found->S_camera1_camera2, kTruth), 1e-9);
  EXPECT_EQ(found->num_inliers, 80);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(found->inliers[i], i >= 120);
  }
}

TEST(EstimateSim3, ToleratesNoiseInPixelsAndDepths) {
  const auto matches =
      MakePair({.matches = 200, .outlier_share = 0.5, .pixel_noise = 0.7, .depth_noise = 0.005});
  const std::optional<Sim3Estimate> found = EstimateSim3(kCamera, matches);
  ASSERT_TRUE(found.has_value());
  EXPECT_GT(found->num_inliers, 90);  // of 100
  EXPECT_LT(Distance(found->S_camera1_camera2, kTruth), 0.015);
}

TEST(EstimateSim3, ToleratesLargeDepthErrors) {
  // At the truth itself only about a third of the good matches fit, so triples alone are seldom near enough.
  const auto matches =
      MakePair({.matches = 200, .outlier_share = 0.5, .pixel_noise = 0.7, .depth_noise = 0.02});
  const std::optional<Sim3Estimate> found = EstimateSim3(kCamera, matches);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(Distance(found->S_camera1_camera2, kTruth), 0.06);
}

TEST(EstimateSim3, RepeatsToTheLastBit) {
  const auto matches =
      MakePair({.matches = 200, .outlier_share = 0.5, .pixel_noise = 0.7, .depth_noise = 0.005});
  const auto first = EstimateSim3(kCamera, matches);
  const auto second = EstimateSim3(kCamera, matches);
  ASSERT_TRUE(first.has_value() && second.has_value());
  EXPECT_EQ(first->S_camera1_camera2.Matrix(), second->S_camera1_camera2.Matrix());
  EXPECT_EQ(first->inliers, second->inliers);
}

TEST(EstimateSim3, RefusesInconsistentMatches) {
  EXPECT_FALSE(EstimateSim3(kCamera, MakePair({.matches = 200, .outlier_share = 1.0})).has_value());
  EXPECT_FALSE(EstimateSim3(kCamera, MakePair({.matches = 19})).has_value());
  EXPECT_FALSE(EstimateSim3(kCamera, {}).has_value());
}

TEST(EstimateSim3, RefusesCollinearPoints) {
  std::vector<Sim3Match> matches;
  for (int i = 0; i < 50; ++i) {
    Sim3Match match;
    match.p_camera1 = {0.02 * i - 0.5, 0.01 * i, 4.0};
    match.p_camera2 = kTruth.Inverse() * match.p_camera1;
    match.pixel1 = kCamera.Project(match.p_camera1);
    match.pixel2 = kCamera.Project(match.p_camera2);
    matches.push_back(match);
  }
  EXPECT_FALSE(EstimateSim3(kCamera, matches).has_value());
}

TEST(EstimateSim3, CountsPointBehindOtherCameraAsOutlier) {
  std::vector<Sim3Match> matches = MakePair({});
  // Mirrored through the second camera's centre it projects onto the same pixel.
  matches[0].p_camera2 = -matches[0].p_camera2;
  matches[0].p_camera1 = kTruth * matches[0].p_camera2;
  const auto found = EstimateSim3(kCamera, matches);
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->inliers[0]);
  EXPECT_EQ(found->num_inliers, 99);
}

// Central differences over S' = Exp(x) S, the step that RefineSim3 makes.
TEST(LinearizeSim3, JacobianAgreesWithNumericOne) {
  constexpr double kStep = 1e-6;
  for (const Sim3Match& match : MakePair({.matches = 30, .pixel_noise = 5.0})) {
    const Sim3Linearization at = LinearizeSim3(kCamera, kTruth, match);
    EXPECT_LT((at.residual.head<2>() - (kCamera.Project(kTruth * match.p_camera2) - match.pixel1)).norm(),
              1e-12);
    for (int i = 0; i < 7; ++i) {
      const Vector7d step = kStep * Vector7d::Unit(i);
      const Eigen::Vector4d numeric = (LinearizeSim3(kCamera, ExpSim3(step) * kTruth, match).residual -
                                       LinearizeSim3(kCamera, ExpSim3(-step) * kTruth, match).residual) /
                                      (2.0 * kStep);
      EXPECT_LT((numeric - at.jacobian.col(i)).norm(), 1e-6 * (1.0 + numeric.norm())) << "column " << i;
    }
  }
}

Sim3d Disturbed(const Sim3d& S) {
  Vector7d x;
  x << 0.03, -0.02, 0.02, 0.1, -0.1, 0.05, 0.05;
  return ExpSim3(x) * S;
}

TEST(RefineSim3, ConvergesFromDisturbedStartAndFindsOutliers) {
  const std::vector<Sim3Match> matches = MakePair({.matches = 100, .outlier_share = 0.2});
  Sim3d S = Disturbed(kTruth);
  std::vector<bool> inliers;
  EXPECT_EQ(RefineSim3(kCamera, matches, S, inliers), 80);
  EXPECT_LT(Distance(S, kTruth), 1e-6);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(inliers[i], i >= 20);
  }
}

TEST(RefineSim3, ToleratesNoiseInPixelsAndDepths) {
  const auto matches =
      MakePair({.matches = 200, .outlier_share = 0.3, .pixel_noise = 0.7, .depth_noise = 0.005});
  Sim3d S = Disturbed(kTruth);
  const double before = Distance(S, kTruth);
  std::vector<bool> inliers;
  EXPECT_GT(RefineSim3(kCamera, matches, S, inliers), 125);  // of 140
  EXPECT_LT(Distance(S, kTruth), before / 15.0);
}

TEST(RefineSim3, KeepsSimilarityWhenUnderdetermined) {
  const std::vector<Sim3Match> matches = MakePair({.matches = 2});
  const Sim3d start = Disturbed(kTruth);
  Sim3d S = start;
  std::vector<bool> inliers;
  EXPECT_EQ(RefineSim3(kCamera, matches, S, inliers), 0);
  EXPECT_EQ(S.Matrix(), start.Matrix());
}

}  // namespace
}  // namespace sqslam
