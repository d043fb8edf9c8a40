#include "slam/objects/size_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sqslam {
namespace {

std::vector<Eigen::Vector3d> SurfacePoints(const Superquadric& shape, int count, double noise,
                                           unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> gaussian(0.0, noise);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d d(uniform(generator), uniform(generator), uniform(generator));
    d[i % 3] = i % 2 == 0 ? 1.0 : -1.0;
    d = d.cwiseProduct(shape.half_size);
    points.push_back(d / shape.RadialScale(d) * (1.0 + gaussian(generator)));
  }
  return points;
}

TEST(Extents, SpansAllPoints) {
  std::vector<Eigen::Vector3d> points = SurfacePoints({{0.2, 0.1, 0.3}, 0.1, 0.1}, 600, 0.0, 1);
  const SizeShapeOptions options;
  EXPECT_TRUE(EstimateExtents(points, options).half_size.isApprox(Eigen::Vector3d(0.2, 0.1, 0.3), 0.02));
  points.push_back({1.2, 0.0, 0.0});
  const Extents stretched = EstimateExtents(points, options);
  EXPECT_NEAR(stretched.half_size.x(), 0.7, 0.01);
  EXPECT_NEAR(stretched.centre.x(), 0.5, 0.01);
}

TEST(Extents, KeepsSomeThicknessOfFlatClouds) {
  const std::vector<Eigen::Vector3d> flat = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_GT(EstimateExtents(flat, SizeShapeOptions()).half_size.z(), 0.0);
}

TEST(ShapeWeights, RunFromTheNearestToTheFarthestPoint) {
  const std::vector<Eigen::Vector3d> points = {{1, 0, 0}, {0, 3, 0}, {0, 0, 2}};
  EXPECT_EQ(ShapeWeights(points), (std::vector<double>{0.0, 1.0, 0.5}));
}

TEST(FitShape, RecoversTheExponents) {
  SizeShapeOptions options;
  options.regularisation = 0.0;
  for (const auto& [e1, e2] :
       {std::pair(0.15, 0.15), std::pair(1.0, 1.0), std::pair(0.2, 1.0), std::pair(1.6, 0.6)}) {
    const Superquadric truth{{0.1, 0.15, 0.2}, e1, e2};
    const ShapeFit fit = FitShape(SurfacePoints(truth, 600, 0.005, 4), truth.half_size, options);
    EXPECT_NEAR(fit.e1, e1, 0.08);
    EXPECT_NEAR(fit.e2, e2, 0.08);
  }
}

TEST(FitShape, StaysInRangeOnAnyInput) {
  const Eigen::Vector3d half(0.1, 0.1, 0.1);
  for (const auto& points : {std::vector<Eigen::Vector3d>{}, std::vector<Eigen::Vector3d>{{0, 0, 0}},
                             std::vector<Eigen::Vector3d>(5, Eigen::Vector3d(9, 9, 9))}) {
    const ShapeFit fit = FitShape(points, half, SizeShapeOptions());
    EXPECT_GE(fit.e1, kMinShapeExponent);
    EXPECT_LE(fit.e2, kMaxShapeExponent);
    EXPECT_TRUE(std::isfinite(fit.cost));
  }
}

}  // namespace
}  // namespace sqslam
