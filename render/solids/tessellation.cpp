#include "render/solids/tessellation.h"

#include <cmath>
#include <numbers>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

double SignedPower(double base, double exponent) {
  return std::copysign(std::pow(std::abs(base), exponent), base);
}

// Samples points at equal steps of an angle from its cosine and sine.
std::vector<SuperellipsePoint> Sample(double first, double last, int segments, const auto& point_at) {
  // Exactly zero at quarter turns: small exponents would amplify rounding errors near zero.
  const auto snap = [](double value) { return std::abs(value) < 1e-12 ? 0.0 : value; };
  std::vector<SuperellipsePoint> points;
  for (int i = 0; i <= segments; ++i) {
    const double angle = first + (last - first) * i / segments;
    points.push_back(point_at(snap(std::cos(angle)), snap(std::sin(angle))));
  }
  return points;
}

}  // namespace

std::vector<SuperellipsePoint> SampleUniformInParameter(double e, double first, double last, int segments) {
  return Sample(first, last, segments, [e](double c, double s) {
    return SuperellipsePoint{SignedPower(c, e), SignedPower(s, e), SignedPower(c, 2.0 - e),
                             SignedPower(s, 2.0 - e)};
  });
}

std::vector<SuperellipsePoint> SampleUniformInPolarAngle(double e, double first, double last, int segments) {
  return Sample(first, last, segments, [e](double c, double s) {
    const double norm = SuperellipseNorm(c, s, e);
    return SuperellipsePoint{c / norm, s / norm, SignedPower(c / norm, (2.0 - e) / e),
                             SignedPower(s / norm, (2.0 - e) / e)};
  });
}

Eigen::Vector3d SurfacePoint(const Superquadric& shape, const SuperellipsePoint& profile,
                             const SuperellipsePoint& section) {
  return shape.half_size.cwiseProduct(
      Eigen::Vector3d(profile.x * section.x, profile.x * section.y, profile.y));
}

Eigen::Vector3d SurfaceNormal(const Superquadric& shape, const SuperellipsePoint& profile,
                              const SuperellipsePoint& section) {
  const Eigen::Vector3d normal(profile.normal_x * section.normal_x, profile.normal_x * section.normal_y,
                               profile.normal_y);
  return normal.cwiseQuotient(shape.half_size).normalized();
}

void AppendGridTriangles(std::size_t rows, std::size_t columns, bool poles, TriangleMesh& mesh) {
  for (std::size_t row = 0; row + 1 < rows; ++row) {
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      const auto a = static_cast<std::int32_t>(row * columns + column);
      const std::int32_t b = a + static_cast<std::int32_t>(columns);
      if (row > 0 || !poles) {
        mesh.triangles.push_back({a, a + 1, b + 1});
      }
      if (row + 2 < rows || !poles) {
        mesh.triangles.push_back({a, b + 1, b});
      }
    }
  }
}

TriangleMesh Tessellate(const Superquadric& shape, int segments) {
  constexpr double kPi = std::numbers::pi;
  const auto profile = SampleUniformInParameter(shape.e1, -0.5 * kPi, 0.5 * kPi, segments / 2);
  const auto section = SampleUniformInParameter(shape.e2, -kPi, kPi, segments);
  TriangleMesh mesh;
  mesh.vertices.reserve(profile.size() * section.size());
  mesh.normals.reserve(profile.size() * section.size());
  for (const SuperellipsePoint& p : profile) {
    for (const SuperellipsePoint& q : section) {
      mesh.vertices.push_back(SurfacePoint(shape, p, q).cast<float>());
      mesh.normals.push_back(SurfaceNormal(shape, p, q).cast<float>());
    }
  }
  AppendGridTriangles(profile.size(), section.size(), true, mesh);
  return mesh;
}

}  // namespace sqslam
