#include "slam/geometry/superquadric_norm.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

const double kPowers[] = {1.0526, 1.3, 2.0, 5.0, 20.0};

TEST(PNorm, FormsAgreeWithDirectPowers) {
  for (const double p : kPowers) {
    for (const auto& [x, y] : {std::pair(0.3, 0.8), {-2.0, 0.7}, {0.4, -0.4}, {-1e-3, -5.0}}) {
      SCOPED_TRACE(testing::Message() << p << ' ' << x << ' ' << y);
      const double expected = std::pow(std::pow(std::abs(x), p) + std::pow(std::abs(y), p), 1.0 / p);
      EXPECT_NEAR(SuperellipseNorm(x, y, 2.0 / p), expected, 1e-13);
      EXPECT_NEAR(PNorm(x, y, p).value, expected, 1e-13);
      EXPECT_NEAR(PNormWithSlope(x, y, p).value, expected, 1e-13);
    }
  }
}

// Oracle: central differences.
TEST(PNorm, DerivativesAgreeWithDifferences) {
  constexpr double kStep = 1e-6;
  const auto norm = [](double x, double y, double p) { return SuperellipseNorm(x, y, 2.0 / p); };
  for (const double p : kPowers) {
    for (const auto& [x, y] : {std::pair(0.3, 0.8), {-2.0, 0.7}, {0.4, -0.4}, {-0.01, -5.0}}) {
      SCOPED_TRACE(testing::Message() << p << ' ' << x << ' ' << y);
      const PNorm gradient(x, y, p);
      const PNormWithSlope full(x, y, p);
      const double by_x = (norm(x + kStep, y, p) - norm(x - kStep, y, p)) / (2.0 * kStep);
      const double by_y = (norm(x, y + kStep, p) - norm(x, y - kStep, p)) / (2.0 * kStep);
      const double by_p = (norm(x, y, p + kStep) - norm(x, y, p - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(gradient.by_x, by_x, 1e-7);
      EXPECT_NEAR(gradient.by_y, by_y, 1e-7);
      EXPECT_NEAR(full.by_x, by_x, 1e-7);
      EXPECT_NEAR(full.by_y, by_y, 1e-7);
      EXPECT_NEAR(full.by_p, by_p, 1e-7);
    }
  }
}

TEST(PNorm, StaysFiniteForZeroAndExtremes) {
  for (const double p : kPowers) {
    for (const double x : {0.0, 5e-324, 1e-300, 1e-20, 1.0, 1e20, 1e300}) {
      for (const double y : {0.0, 5e-324, -1e-300, 1e-20, -1.0, 1e20, 1e300}) {
        SCOPED_TRACE(testing::Message() << p << ' ' << x << ' ' << y);
        const PNorm gradient(x, y, p);
        const PNormWithSlope full(x, y, p);
        for (const double number : {SuperellipseNorm(x, y, 2.0 / p), gradient.value, gradient.by_x,
                                    gradient.by_y, full.value, full.by_x, full.by_y, full.by_p}) {
          EXPECT_TRUE(std::isfinite(number));
        }
      }
    }
    EXPECT_EQ(PNorm(0.0, -3.0, p).by_y, -1.0);
    EXPECT_EQ(PNorm(0.0, -3.0, p).by_x, 0.0);
    EXPECT_EQ(PNormWithSlope(-3.0, 0.0, p).by_x, -1.0);
    EXPECT_EQ(PNormWithSlope(-3.0, 0.0, p).by_p, 0.0);
  }
}

// Hoelder: x . y <= |x|_p |y|_q, with equality where y is the gradient of the norm at x.
TEST(SuperquadricNorm, GradientLiesOnDualSurface) {
  for (const double e1 : {0.1, 0.7, 1.0, 1.9}) {
    for (const double e2 : {0.1, 0.7, 1.0, 1.9}) {
      const Eigen::Vector3d u(0.3, -0.8, 1.3);
      const SuperquadricNorm<PNorm> norm(u, 2.0 / e1, 2.0 / e2);
      const SuperquadricNorm<PNorm> dual(norm.Gradient(), DualPower(e1), DualPower(e2));
      EXPECT_NEAR(dual.Value(), 1.0, 1e-12) << e1 << ' ' << e2;
      EXPECT_NEAR(norm.Gradient().dot(u), norm.Value(), 1e-12) << e1 << ' ' << e2;
      EXPECT_NEAR((dual.Gradient() - u / norm.Value()).norm(), 0.0, 1e-9) << e1 << ' ' << e2;
    }
  }
}

}  // namespace
}  // namespace sqslam
