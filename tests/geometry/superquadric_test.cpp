#include "slam/geometry/superquadric.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/surface_area.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

const std::vector<double> kExponents = {0.1, 0.5, 1.0, 1.4, 1.9};

Superquadric Shape(const Vector3d& half_size, double e1, double e2) { return {half_size, e1, e2}; }

template <typename Check>
void ForEveryShape(Check&& check) {
  for (const double e1 : kExponents) {
    for (const double e2 : kExponents) {
      SCOPED_TRACE(testing::Message() << "e1 " << e1 << " e2 " << e2);
      check(Shape({0.3, 0.7, 1.1}, e1, e2));
    }
  }
}

TEST(Superquadric, ParametricPointsLieOnSurface) {
  ForEveryShape([](const Superquadric& shape) {
    for (int i = -8; i <= 8; ++i) {
      for (int j = -8; j <= 8; ++j) {
        const Vector3d p = shape.PointAt(i * pi / 16, j * pi / 8);
        EXPECT_NEAR(shape.RadialScale(p), 1.0, 1e-12);
        EXPECT_NEAR(shape.RadialDistance(p), 0.0, 1e-12);
        EXPECT_NEAR(shape.F(p), 1.0, 1e-9);
      }
    }
  });
}

TEST(Superquadric, PolesAndAxisPointsAreExactForSmallExponents) {
  const Superquadric box = Shape({1, 2, 3}, 0.1, 0.1);
  EXPECT_EQ(box.PointAt(pi / 2, 0.3), Vector3d(0, 0, 3));
  EXPECT_EQ(box.PointAt(-pi / 2, 0.3), Vector3d(0, 0, -3));
  EXPECT_EQ(box.PointAt(0, pi / 2), Vector3d(0, 2, 0));
  EXPECT_EQ(box.PointAt(0, pi), Vector3d(-1, 0, 0));
  const Superquadric pinched = Shape({1, 2, 3}, 1.9, 1.9);
  EXPECT_EQ(pinched.NormalAt(pi / 2, 0.3), Vector3d(0, 0, 1));
  EXPECT_EQ(pinched.NormalAt(0, pi), Vector3d(-1, 0, 0));
}

// Oracle: F written down as printed in Eq. 2.
TEST(Superquadric, InsideOutsideFunctionMatchesEquation2) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  ForEveryShape([&](const Superquadric& shape) {
    for (int i = 0; i < 50; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      const Vector3d u = p.cwiseQuotient(shape.half_size).cwiseAbs();
      const double xy = std::pow(u.x(), 2 / shape.e2) + std::pow(u.y(), 2 / shape.e2);
      const double expected = std::pow(xy, shape.e2 / shape.e1) + std::pow(u.z(), 2 / shape.e1);
      EXPECT_NEAR(shape.F(p) / expected, 1.0, 1e-9);
      EXPECT_NEAR(shape.RadialDistance(p), p.norm() * (1 - std::pow(expected, -shape.e1 / 2)), 1e-9);
    }
  });
}

// Oracle: central differences of the parametric surface.
TEST(Superquadric, NormalPointsOutAndIsOrthogonalToTangents) {
  ForEveryShape([](const Superquadric& shape) {
    constexpr double kStep = 1e-6;
    for (int i = -7; i <= 7; i += 2) {
      for (int j = -7; j <= 7; j += 2) {
        const double eta = i * pi / 16;
        const double omega = j * pi / 8;
        const Vector3d along_eta = shape.PointAt(eta + kStep, omega) - shape.PointAt(eta - kStep, omega);
        const Vector3d along_omega = shape.PointAt(eta, omega + kStep) - shape.PointAt(eta, omega - kStep);
        const Vector3d normal = shape.NormalAt(eta, omega);
        EXPECT_NEAR(normal.norm(), 1.0, 1e-12);
        EXPECT_NEAR(normal.dot(along_eta.normalized()), 0.0, 1e-5);
        EXPECT_NEAR(normal.dot(along_omega.normalized()), 0.0, 1e-5);
        EXPECT_GT(normal.dot(shape.PointAt(eta, omega)), 0.0);
      }
    }
  });
}

TEST(Superquadric, RadialScaleObeysNormAxioms) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  ForEveryShape([&](const Superquadric& shape) {
    for (int i = 0; i < 50; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      const Vector3d q(coordinate(random), coordinate(random), coordinate(random));
      EXPECT_NEAR(shape.RadialScale(3.5 * p), 3.5 * shape.RadialScale(p), 1e-12 * shape.RadialScale(p) * 10);
      EXPECT_LE(shape.RadialScale(p + q), shape.RadialScale(p) + shape.RadialScale(q) + 1e-12);
    }
  });
}

TEST(Superquadric, RadialDistanceEqualsEuclideanDistanceForSpheres) {
  const Superquadric sphere = Shape({2, 2, 2}, 1, 1);
  EXPECT_NEAR(sphere.RadialDistance({0, 3, 4}), 3.0, 1e-12);
  EXPECT_NEAR(sphere.RadialDistance({0.6, 0, 0.8}), -1.0, 1e-12);
  EXPECT_NEAR(sphere.RadialDistance({1e-200, 0, 0}), -2.0, 1e-12);
  EXPECT_EQ(Shape({3, 1, 2}, 0.4, 0.4).RadialDistance(Vector3d::Zero()), -1.0);
}

TEST(Superquadric, StaysFiniteAtExponentLimits) {
  const std::vector<double> coordinates = {0.0, 5e-324, 1e-300, 1e-20, 1.0, 1e20, 1e300};
  for (const double e1 : {0.1, 1.9}) {
    for (const double e2 : {0.1, 1.9}) {
      const Superquadric shape = Shape({0.01, 1.0, 100.0}, e1, e2);
      for (const double x : coordinates) {
        for (const double y : coordinates) {
          for (const double z : coordinates) {
            const Vector3d p(x, -y, z);
            SCOPED_TRACE(testing::Message() << e1 << ' ' << e2 << " at " << p.transpose());
            EXPECT_TRUE(std::isfinite(shape.F(p)));
            EXPECT_TRUE(std::isfinite(shape.RadialScale(p)));
            EXPECT_TRUE(std::isfinite(shape.RadialDistance(p)));
            EXPECT_EQ(shape.F(p) > 1.0, shape.RadialScale(p) > 1.0);
          }
        }
      }
    }
  }
}

TEST(Superquadric, MeanSquaresOfSphereAndOfRandomShapes) {
  EXPECT_TRUE(
      (Superquadric{{2.0, 2.0, 2.0}, 1.0, 1.0}.MeanSquares().isApprox(Eigen::Vector3d::Constant(0.8))));
  for (const auto& [e1, e2] : {std::pair(0.1, 0.4), {0.3, 1.0}, {1.5, 0.7}}) {
    const Superquadric shape{{0.3, 0.7, 1.1}, e1, e2};
    constexpr int kSteps = 100;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int inside = 0;
    for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {  // the centres of cells of the first octant
      const Eigen::Array3d cell(i % kSteps, i / kSteps % kSteps, i / (kSteps * kSteps));
      const Eigen::Vector3d p = (shape.half_size.array() * (cell + 0.5) / kSteps).matrix();
      if (shape.RadialScale(p) < 1.0) {
        sum += p.cwiseAbs2();
        ++inside;
      }
    }
    EXPECT_TRUE((sum / inside).isApprox(shape.MeanSquares(), 2e-3)) << e1 << ' ' << e2;
  }
}

TEST(Superquadric, VolumeOfSphereEllipsoidCylinderAndBox) {
  EXPECT_NEAR(Shape({2, 2, 2}, 1, 1).Volume(), 4.0 / 3.0 * pi * 8, 1e-10);
  EXPECT_NEAR(Shape({1, 2, 3}, 1, 1).Volume(), 4.0 / 3.0 * pi * 6, 1e-10);
  // Limits e -> 0: an elliptic cylinder and a box; and e = 2, the octahedron.
  EXPECT_NEAR(Shape({1, 2, 3}, 1e-6, 1).Volume(), pi * 2 * 6, 1e-4);
  EXPECT_NEAR(Shape({1, 2, 3}, 1e-6, 1e-6).Volume(), 48.0, 1e-4);
  EXPECT_NEAR(Shape({1, 2, 3}, 2, 2).Volume(), 8.0, 1e-10);
}

// Oracle: the share of uniform points of the bounding box for which F <= 1.
TEST(Superquadric, VolumeAgreesWithMonteCarlo) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr int kSamples = 40000;
  ForEveryShape([&](const Superquadric& shape) {
    int inside = 0;
    for (int i = 0; i < kSamples; ++i) {
      const Vector3d p = shape.half_size.cwiseProduct(Vector3d(unit(random), unit(random), unit(random)));
      inside += shape.F(p) <= 1.0 ? 1 : 0;
    }
    const double share = shape.Volume() / (8 * shape.half_size.prod());
    const double sigma = std::sqrt(share * (1 - share) / kSamples);
    EXPECT_NEAR(static_cast<double>(inside) / kSamples, share, 4.5 * sigma);
  });
}

TEST(Superquadric, SurfaceAreaOfSphereSpheroidBoxAndOctahedron) {
  EXPECT_NEAR(SurfaceArea(Shape({2, 2, 2}, 1, 1)), 16 * pi, 1e-9);
  const double eccentricity = std::sqrt(1.0 - 1.0 / 9.0);  // prolate, a = 1, c = 3
  const double prolate = 2 * pi * (1 + 3.0 / eccentricity * std::asin(eccentricity));
  EXPECT_NEAR(SurfaceArea(Shape({1, 1, 3}, 1, 1)), prolate, 1e-8);
  EXPECT_NEAR(SurfaceArea(Shape({1, 1, 1}, 2, 2)), 4 * std::sqrt(3.0), 1e-9);
  EXPECT_LT(SurfaceArea(Shape({1, 2, 3}, 0.1, 0.1)),
            88.0);  // the sharp box; rounded edges take some away
}

// Oracle: the triangles of a fine tessellation of Eq. 1, whose area grows towards the true one.
TEST(Superquadric, SurfaceAreaAgreesWithTessellation) {
  for (const auto& [e1, e2] : {std::pair{0.1, 0.1}, {0.6, 0.6}, {1.0, 0.4}, {1.5, 0.8}, {1.2, 1.7}}) {
    const Superquadric shape = Shape({0.3, 0.7, 1.1}, e1, e2);
    constexpr int kSteps = 400;
    double area = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const auto point = [&](int k, int l) {
          return shape.PointAt(0.5 * pi * k / kSteps, 0.5 * pi * l / kSteps);
        };
        const Vector3d a = point(i, j), b = point(i + 1, j), c = point(i, j + 1), d = point(i + 1, j + 1);
        area += 0.5 * ((b - a).cross(c - a).norm() + (b - d).cross(c - d).norm());
      }
    }
    EXPECT_NEAR(SurfaceArea(shape) / (8 * area), 1.0, 1e-3) << e1 << ' ' << e2;
  }
}

// Oracle: central differences.
TEST(Superquadric, RadialDistanceGradientAgreesWithDifferences) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  ForEveryShape([&](const Superquadric& shape) {
    constexpr double kStep = 1e-6;
    const auto slope = [&](const auto& distance) {
      return (distance(kStep) - distance(-kStep)) / (2.0 * kStep);
    };
    for (int i = 0; i < 20; ++i) {
      const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
      const RadialDistanceGradient gradient = shape.RadialDistanceWithGradient(p);
      const auto with = [&](double e1, double e2) {
        return Shape(shape.half_size, e1, e2).RadialDistance(p);
      };
      EXPECT_NEAR(gradient.value, shape.RadialDistance(p), 1e-12);
      EXPECT_NEAR(gradient.by_e1, slope([&](double h) { return with(shape.e1 + h, shape.e2); }), 1e-6);
      EXPECT_NEAR(gradient.by_e2, slope([&](double h) { return with(shape.e1, shape.e2 + h); }), 1e-6);
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d unit = Vector3d::Unit(axis);
        EXPECT_NEAR(gradient.by_point[axis],
                    slope([&](double h) { return shape.RadialDistance(p + h * unit); }), 1e-5);
        EXPECT_NEAR(gradient.by_log_half_size[axis], slope([&](double h) {
                      Superquadric grown = shape;
                      grown.half_size[axis] *= std::exp(h);
                      return grown.RadialDistance(p);
                    }),
                    1e-6);
      }
    }
  });
}

TEST(Superquadric, RadialDistanceGradientStaysFiniteOnAxes) {
  ForEveryShape([](const Superquadric& shape) {
    EXPECT_EQ(shape.RadialDistanceWithGradient(Vector3d::Zero()).value, -0.3);
    for (int axis = 0; axis < 3; ++axis) {
      const double half = shape.half_size[axis];
      const RadialDistanceGradient gradient =
          shape.RadialDistanceWithGradient((half + 0.5) * Vector3d::Unit(axis));
      EXPECT_NEAR(gradient.value, 0.5, 1e-12);
      EXPECT_NEAR((gradient.by_point - Vector3d::Unit(axis)).norm(), 0.0, 1e-12);
      EXPECT_NEAR((gradient.by_log_half_size + half * Vector3d::Unit(axis)).norm(), 0.0, 1e-12);
      EXPECT_EQ(gradient.by_e1, 0.0);
      EXPECT_EQ(gradient.by_e2, 0.0);
    }
  });
}

// The inverse of ToParameters().
PosedSuperquadric FromParameters(const SuperquadricParameters& parameters) {
  using Eigen::AngleAxisd;
  const Eigen::Quaterniond rotation = AngleAxisd(parameters[7], Vector3d::UnitZ()) *
                                      AngleAxisd(parameters[6], Vector3d::UnitY()) *
                                      AngleAxisd(parameters[5], Vector3d::UnitX());
  return {{parameters.head<3>(), parameters[3], parameters[4]}, {rotation, parameters.tail<3>()}};
}

// The farthest of many surface points, against the closed form.
TEST(Superquadric, SupportPointMaximisesExtent) {
  const PosedSuperquadric posed =
      FromParameters((SuperquadricParameters() << 1, 1, 1, 1, 1, 0.2, -0.5, 2.5, 4.0, -5.0, 6.0).finished());
  ForEveryShape([&](const Superquadric& shape) {
    const Vector3d n(0.4, -0.7, 0.3);
    const Vector3d support = shape.SupportPoint(n);
    EXPECT_NEAR(shape.RadialScale(support), 1.0, 1e-9);
    EXPECT_NEAR(shape.SupportExtent(n), n.dot(support), 1e-12);
    double farthest = -1.0;
    for (int i = 0; i <= 200; ++i) {
      for (int j = 0; j <= 400; ++j) {
        farthest = std::max(farthest, n.dot(shape.PointAt(pi * (i / 200.0 - 0.5), pi * (j / 200.0 - 1.0))));
      }
    }
    EXPECT_LE(farthest, n.dot(support) + 1e-9);
    EXPECT_NEAR(farthest, n.dot(support), 0.02 * farthest);
    const PosedSuperquadric placed{shape, posed.T_map_object};
    const Vector3d n_map = posed.T_map_object.rotation * n;
    EXPECT_NEAR((SupportPoint(placed, n_map) - placed.T_map_object * support).norm(), 0.0, 1e-12);
    EXPECT_NEAR(SupportExtent(placed, n_map), n.dot(support), 1e-12);
  });
}

TEST(Superquadric, SupportPointHitsMiddleOfBoxFace) {
  const Superquadric box = Shape({1, 2, 3}, 0.0, 0.0);
  EXPECT_EQ(box.SupportPoint({0, 0, 2}), Vector3d(0, 0, 3));
  EXPECT_EQ(box.SupportPoint({0.5, -0.1, 0}), Vector3d(1, -2, 0));
  EXPECT_EQ(box.SupportPoint({0.5, -0.1, 1e-9}), Vector3d(1, -2, 3));
  EXPECT_NEAR(box.SupportExtent({0.5, -0.1, 0}), 0.7, 1e-15);
  const Superquadric ball = Shape({2, 2, 2}, 1, 1);
  EXPECT_NEAR((ball.SupportPoint({0, 3, 4}) - Vector3d(0, 1.2, 1.6)).norm(), 0.0, 1e-12);
}

TEST(Superquadric, MovesWithFrame) {
  const Sim3d S{2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized())), {1, -2, 3}};
  const PosedSuperquadric solid = FromParameters(
      (SuperquadricParameters() << 0.3, 0.7, 1.1, 0.4, 1.6, 0.2, -0.5, 2.5, 4.0, -5.0, 6.0).finished());
  const PosedSuperquadric moved = S * solid;
  const Vector3d p = solid.T_map_object * solid.shape.PointAt(0.4, 1.1);
  EXPECT_NEAR((moved.T_map_object * moved.shape.PointAt(0.4, 1.1) - S * p).norm(), 0.0, 1e-12);
}

TEST(Superquadric, ElevenParametersRoundTrip) {
  SuperquadricParameters parameters;
  parameters << 0.3, 0.7, 1.1, 0.4, 1.6, 0.2, -0.5, 2.5, 4.0, -5.0, 6.0;
  EXPECT_TRUE(ToParameters(FromParameters(parameters)).isApprox(parameters, 1e-12));
  const PosedSuperquadric upright =
      FromParameters((SuperquadricParameters() << 1, 1, 1, 1, 1, 0, 0, pi / 2, 0, 0, 0).finished());
  EXPECT_NEAR((upright.T_map_object * Vector3d(1, 0, 0) - Vector3d(0, 1, 0)).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace sqslam
