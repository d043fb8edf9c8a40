#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slam/fitting/surface_measures.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;

Superquadric WithChange(const Superquadric& shape, int parameter, double change) {
  Superquadric result = shape;
  if (parameter < 3) {
    result.half_size[parameter] *= std::exp(change);
  } else {
    (parameter == 3 ? result.e1 : result.e2) += change;
  }
  return result;
}

TEST(SurfaceDistance, DerivativesAgreeWithDifferences) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  for (const double e1 : {0.15, 0.5, 1.0, 1.5, 1.85}) {
    for (const double e2 : {0.15, 0.5, 1.0, 1.5, 1.85}) {
      const Superquadric shape{{0.4, 0.8, 1.1}, e1, e2};
      for (int i = 0; i < 20; ++i) {
        const Vector3d p = shape.half_size.cwiseProduct(
            Vector3d(coordinate(random), coordinate(random), coordinate(random)));
        using Jet = ceres::Jet<double, 8>;
        Eigen::Matrix<Jet, 3, 1> at;
        Eigen::Matrix<Jet, 3, 1> half;
        for (int k = 0; k < 3; ++k) {
          at[k] = Jet(p[k], k);
          half[k] = exp(Jet(std::log(shape.half_size[k]), 3 + k));
        }
        const Jet derived = SurfaceDistanceOf<Jet>(half, Jet(e1, 6), Jet(e2, 7))(at);
        const SurfaceDistance distance(shape);
        EXPECT_NEAR(derived.a, distance(p), 1e-12 * (1.0 + std::abs(derived.a)));
        constexpr double kStep = 1e-6;
        const auto expect = [&](double expected, double analytic) {
          EXPECT_NEAR(expected, analytic, 2e-4 * (1.0 + std::abs(expected)))
              << "e1 " << e1 << " e2 " << e2 << " p " << p.transpose();
        };
        for (int k = 0; k < 3; ++k) {
          const Vector3d step = kStep * Vector3d::Unit(k);
          expect((distance(p + step) - distance(p - step)) / (2 * kStep), derived.v[k]);
        }
        for (int k = 0; k < 5; ++k) {
          const SurfaceDistance more(WithChange(shape, k, kStep));
          const SurfaceDistance less(WithChange(shape, k, -kStep));
          const double difference = (more(p) - less(p)) / (2 * kStep);
          expect(difference, derived.v[3 + k]);
        }
      }
    }
  }
}

TEST(SurfaceDistance, ApproximatesEuclideanDistanceNearSurface) {
  for (const double e1 : {0.1, 0.6, 1.0, 1.9}) {
    for (const double e2 : {0.1, 1.0, 1.6}) {
      const Superquadric shape{{0.3, 0.9, 1.2}, e1, e2};
      const SurfaceDistance distance(shape);
      for (const double eta : {-1.2, -0.7, 0.1, 0.8}) {
        for (const double omega : {-2.5, -0.6, 0.7, 2.2}) {
          const Vector3d p = shape.PointAt(eta, omega);
          const Vector3d n = shape.NormalAt(eta, omega);
          EXPECT_NEAR(distance(p), 0.0, 5e-3 * shape.half_size.mean());
          EXPECT_NEAR(distance(p + 1e-4 * n) - distance(p), 1e-4, 5e-6)
              << e1 << " " << e2 << " " << eta << " " << omega;
          EXPECT_NEAR(distance(p - 1e-4 * n) - distance(p), -1e-4, 5e-6);
        }
      }
    }
  }
}

TEST(SurfaceDistance, KeepsPointsBeyondRimFar) {
  const SurfaceDistance distance(Superquadric{{1.0, 1.0, 0.1}, 0.1, 0.1});
  EXPECT_GT(distance({2.0, 0.0, 0.21}), 0.5);
  EXPECT_NEAR(distance({0.2, 0.1, 0.11}), 0.01, 1e-3);
}

}  // namespace
}  // namespace sqslam
