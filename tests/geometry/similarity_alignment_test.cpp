#include "slam/geometry/similarity_alignment.h"

#include <gtest/gtest.h>

#include <random>

namespace sqslam {
namespace {

using Eigen::Vector3d;

const Sim3d kTruth{
    0.37, Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Vector3d(1, 2, -1).normalized())), {4, -5, 6}};

std::vector<Vector3d> RandomPoints(int count) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(normal(random), normal(random), normal(random));
  }
  return points;
}

std::vector<Vector3d> Mapped(const Sim3d& S, const std::vector<Vector3d>& points) {
  std::vector<Vector3d> mapped;
  for (const Vector3d& p : points) {
    mapped.push_back(S * p);
  }
  return mapped;
}

TEST(AlignSimilarity, RecoversSimilarity) {
  for (const int count : {3, 4, 100}) {
    const auto source = RandomPoints(count);
    const auto S = AlignSimilarity(source, Mapped(kTruth, source));
    ASSERT_TRUE(S.has_value());
    EXPECT_NEAR(S->scale, kTruth.scale, 1e-9);
    EXPECT_NEAR(S->rotation.angularDistance(kTruth.rotation), 0.0, 1e-7);
    EXPECT_NEAR((S->translation - kTruth.translation).norm(), 0.0, 1e-8);
  }
}

TEST(AlignSimilarity, MinimisesSquaredErrorOfNoisyPoints) {
  const auto source = RandomPoints(30);
  auto target = Mapped(kTruth, source);
  const auto noise = RandomPoints(30);
  for (std::size_t i = 0; i < target.size(); ++i) {
    target[i] += 0.02 * noise[(i + 7) % noise.size()];
  }
  const auto cost = [&](const Sim3d& S) {
    double sum = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i) {
      sum += (S * source[i] - target[i]).squaredNorm();
    }
    return sum;
  };
  const auto best = AlignSimilarity(source, target);
  ASSERT_TRUE(best.has_value());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-3, 1e-3}) {
      Sim3d moved = *best;
      moved.translation[axis] += step;
      EXPECT_GT(cost(moved), cost(*best));
      Sim3d turned = *best;
      turned.rotation = turned.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(step, Vector3d::Unit(axis)));
      EXPECT_GT(cost(turned), cost(*best));
      Sim3d scaled = *best;
      scaled.scale *= 1.0 + step;
      EXPECT_GT(cost(scaled), cost(*best));
    }
  }
}

TEST(AlignSimilarity, ReturnsRotationForMirroredTarget) {
  const auto source = RandomPoints(20);
  auto target = source;
  for (Vector3d& p : target) {
    p.x() = -p.x();
  }
  const auto S = AlignSimilarity(source, target);
  if (S.has_value()) {  // may be empty
    EXPECT_NEAR(S->rotation.toRotationMatrix().determinant(), 1.0, 1e-9);
    EXPECT_GT(S->scale, 0.0);
  }
}

TEST(AlignSimilarity, ReturnsNothingForDegenerateInput) {
  const std::vector<Vector3d> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  const std::vector<Vector3d> point(4, Vector3d(1, 2, 3));
  const auto good = RandomPoints(4);
  EXPECT_FALSE(AlignSimilarity({}, {}).has_value());
  EXPECT_FALSE(AlignSimilarity({good[0], good[1]}, {good[0], good[1]}).has_value());
  EXPECT_FALSE(AlignSimilarity(line, good).has_value());
  EXPECT_FALSE(AlignSimilarity(good, line).has_value());
  EXPECT_FALSE(AlignSimilarity(point, good).has_value());
  EXPECT_FALSE(AlignSimilarity(good, RandomPoints(5)).has_value());
  auto broken = good;
  broken[1].x() = std::nan("");
  EXPECT_FALSE(AlignSimilarity(broken, good).has_value());
}

// A camera that moves almost along x and looks sideways; the positions in its map have small errors.
TEST(AlignPoses, OrientationsDetermineRotationAboutLine) {
  const auto noise = RandomPoints(200);
  std::vector<Rigid3d> source, target;
  std::vector<Vector3d> source_positions, target_positions;
  for (int i = 0; i < 100; ++i) {
    const Rigid3d pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * i, Vector3d::UnitY())),
                       {0.02 * i, 0.01 * std::sin(0.3 * i), 0.0}};
    source.push_back({pose.rotation, pose.translation + 0.003 * noise[static_cast<std::size_t>(i)]});
    const Vector3d turn = 1e-4 * noise[static_cast<std::size_t>(i) + 100];
    target.push_back({kTruth.rotation * pose.rotation *
                          Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())),
                      kTruth * pose.translation});
    source_positions.push_back(source.back().translation);
    target_positions.push_back(target.back().translation);
  }
  const auto by_positions = AlignSimilarity(source_positions, target_positions);
  const auto by_poses = AlignPoses(source, target);
  ASSERT_TRUE(by_positions && by_poses);
  EXPECT_GT(by_positions->rotation.angularDistance(kTruth.rotation), 5e-3);
  EXPECT_LT(by_poses->rotation.angularDistance(kTruth.rotation), 1e-4);
  EXPECT_NEAR(by_poses->scale, kTruth.scale, 1e-3);
  EXPECT_LT((by_poses->translation - kTruth.translation).norm(), 2e-3);
}

TEST(AlignPoses, RecoversExactPosesUnlessOnLine) {
  std::vector<Rigid3d> source, target, line;
  for (const Vector3d& p : RandomPoints(5)) {
    source.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(p.x(), Vector3d::UnitZ())), p});
    target.push_back({kTruth.rotation * source.back().rotation, kTruth * p});
    line.push_back({source.back().rotation, {p.x(), 0.0, 0.0}});
  }
  const auto S = AlignPoses(source, target);
  ASSERT_TRUE(S.has_value());
  EXPECT_NEAR(S->scale, kTruth.scale, 1e-9);
  EXPECT_NEAR(S->rotation.angularDistance(kTruth.rotation), 0.0, 1e-7);
  EXPECT_NEAR((S->translation - kTruth.translation).norm(), 0.0, 1e-8);
  EXPECT_FALSE(AlignPoses(line, target).has_value());
}

}  // namespace
}  // namespace sqslam
