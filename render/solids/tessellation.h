#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A closed triangle mesh in the object frame with one normal per vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;                // outward, unit length
  std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from outside
};

// Appends two triangles per cell of a row-major grid of vertices. `poles`: the first and the last row are one
// point each, so that one of the two triangles there has no area and is left out.
void AppendGridTriangles(std::size_t rows, std::size_t columns, bool poles, TriangleMesh& mesh);

// One point of the unit superellipse |x|^(2/e) + |y|^(2/e) = 1 with its (unscaled) outward normal.
struct SuperellipsePoint {
  double x = 1.0;
  double y = 0.0;
  double normal_x = 1.0;
  double normal_y = 0.0;
};

// Returns points at equal steps of the parameter of Eq. 1 from angle `first` to `last` (radians, inclusive).
// For small e they are dense at the corners, as silhouettes need.
std::vector<SuperellipsePoint> SampleUniformInParameter(double e, double first, double last, int segments);

// The same at equal steps of the polar angle, which covers flat sides evenly, as per-vertex shading needs.
std::vector<SuperellipsePoint> SampleUniformInPolarAngle(double e, double first, double last, int segments);

// Return the surface point and the outward unit normal of Eq. 1 for a point of the profile (exponent e1, x >=
// 0) and one of the horizontal cross-section (exponent e2).
Eigen::Vector3d SurfacePoint(const Superquadric& shape, const SuperellipsePoint& profile,
                             const SuperellipsePoint& section);
Eigen::Vector3d SurfaceNormal(const Superquadric& shape, const SuperellipsePoint& profile,
                              const SuperellipsePoint& section);

// Tessellates Eq. 1 on a grid uniform in angle: `segments` steps of longitude (a multiple of 4) and half as
// many of latitude. The poles are rows of coinciding vertices, each with its own normal.
TriangleMesh Tessellate(const Superquadric& shape, int segments = 64);

}  // namespace sqslam
