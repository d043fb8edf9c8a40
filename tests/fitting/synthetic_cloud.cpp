#include "tests/fitting/synthetic_cloud.h"

#include <cmath>
#include <numbers>

namespace sqslam::testing {
namespace {

using Eigen::Vector3d;

Vector3d RandomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

struct Triangle {
  std::array<Vector3d, 3> corners;
  Vector3d normal;
};

// The surface over a grid of cube-mapped directions, whose density does not depend on the exponents.
std::vector<Triangle> Triangulate(const Superquadric& shape) {
  constexpr int kSteps = 96;  // per face of the cube
  std::vector<Triangle> triangles;
  const auto at = [&](int axis, int sign, int i, int j) {
    // tan spreads directions evenly; the cube refines them near the axes, where shapes with e near 2 kink.
    const auto coordinate = [](int k) {
      const double v = 2.0 * k / kSteps - 1.0;
      return std::tan(0.25 * std::numbers::pi * v * (0.4 + 0.6 * v * v));
    };
    Vector3d direction;
    direction[axis] = sign;
    direction[(axis + 1) % 3] = coordinate(i);
    direction[(axis + 2) % 3] = coordinate(j);
    direction = direction.cwiseProduct(shape.half_size).eval();
    return Vector3d(direction / shape.RadialScale(direction));
  };
  const auto add = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    Vector3d normal = (b - a).cross(c - a);
    if (normal.dot(a + b + c) < 0.0) {
      normal = -normal;
    }
    triangles.push_back({{a, b, c}, normal});
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
          const Vector3d a = at(axis, sign, i, j);
          const Vector3d c = at(axis, sign, i + 1, j + 1);
          add(a, at(axis, sign, i + 1, j), c);
          add(a, c, at(axis, sign, i, j + 1));
        }
      }
    }
  }
  return triangles;
}

}  // namespace

Eigen::Quaterniond RandomRotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
}

PosedSuperquadric RandomlyPosed(double e1, double e2, double ratio, std::mt19937_64& random) {
  std::uniform_real_distribution<double> log_size(0.0, std::log(ratio));
  std::uniform_real_distribution<double> distance(1.0, 10.0);
  const Vector3d half(std::exp(log_size(random)), std::exp(log_size(random)), std::exp(log_size(random)));
  const Eigen::Quaterniond rotation = RandomRotation(random);
  return {{half, e1, e2}, {rotation, distance(random) * RandomDirection(random)}};
}

std::vector<Vector3d> SampleCloud(const PosedSuperquadric& superquadric, const CloudOptions& options,
                                  std::mt19937_64& random) {
  const Vector3d view = RandomDirection(random);
  std::vector<Triangle> triangles;
  std::vector<double> areas;
  for (const Triangle& triangle : Triangulate(superquadric.shape)) {
    if (!options.half_seen || triangle.normal.dot(view) > 0.0) {
      triangles.push_back(triangle);
      areas.push_back(triangle.normal.norm());
    }
  }
  std::discrete_distribution<int> pick(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::uniform_real_distribution<double> twice(-2.0, 2.0);
  std::normal_distribution<double> noise(0.0, options.noise * 2.0 * superquadric.shape.half_size.mean());
  std::vector<Vector3d> cloud;
  for (int i = 0; i < options.points; ++i) {
    Vector3d p;
    if (unit(random) < options.outlier_share) {
      p = superquadric.shape.half_size.cwiseProduct(Vector3d(twice(random), twice(random), twice(random)));
    } else {
      const Triangle& triangle = triangles[pick(random)];
      double u = unit(random);
      double v = unit(random);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const auto& [a, b, c] = triangle.corners;
      p = a + u * (b - a) + v * (c - a);
      p += Vector3d(noise(random), noise(random), noise(random));
    }
    cloud.push_back(superquadric.T_map_object * p);
  }
  return cloud;
}

PosedSuperquadric Transformed(const Sim3d& S, const PosedSuperquadric& superquadric) {
  PosedSuperquadric result = superquadric;
  result.shape.half_size *= S.scale;
  result.T_map_object = {S.rotation * superquadric.T_map_object.rotation,
                         S * superquadric.T_map_object.translation};
  return result;
}

double Difference(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  const double size = a.shape.half_size.mean();
  return std::max({(a.shape.half_size - b.shape.half_size).norm() / size, std::abs(a.shape.e1 - b.shape.e1),
                   std::abs(a.shape.e2 - b.shape.e2),
                   (a.T_map_object.translation - b.T_map_object.translation).norm() / size,
                   (a.T_map_object.RotationMatrix() - b.T_map_object.RotationMatrix()).norm()});
}

}  // namespace sqslam::testing
