#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A closed triangle mesh in the object frame with one normal a vertex.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;                // outward, unit length
  std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from outside
};

// Two triangles for each cell of a grid of vertices, row by row. `poles`: the first and the last row are one
// point each, where one of the two has no area and is left out.
void AppendGridTriangles(std::size_t rows, std::size_t columns, bool poles, TriangleMesh& mesh);

// One point of the unit superellipse |x|^(2/e) + |y|^(2/e) = 1 with its (unscaled) outward normal.
struct SuperellipsePoint {
  double x = 1.0;
  double y = 0.0;
  double normal_x = 1.0;
  double normal_y = 0.0;
};

// Points at equal steps of the parameter of Eq. 1 from angle `first` to `last` (radians), both included.
// They crowd at the corners for small e, which is what a silhouette needs.
std::vector<SuperellipsePoint> SampleUniformInParameter(double e, double first, double last, int segments);

// The same at equal steps of the polar angle: even coverage of flat sides, which shading by vertex needs.
std::vector<SuperellipsePoint> SampleUniformInPolarAngle(double e, double first, double last, int segments);

// Surface point and outward unit normal of Eq. 1 from a point of the profile (exponent e1, x >= 0) and one of
// the horizontal cross-section (exponent e2).
Eigen::Vector3d SurfacePoint(const Superquadric& shape, const SuperellipsePoint& profile,
                             const SuperellipsePoint& section);
Eigen::Vector3d SurfaceNormal(const Superquadric& shape, const SuperellipsePoint& profile,
                              const SuperellipsePoint& section);

// The surface of Eq. 1 on a grid uniform in angle: `segments` steps of longitude (a multiple of 4) and half
// as many of latitude. The poles are rows of coinciding vertices, each with its own normal.
TriangleMesh Tessellate(const Superquadric& shape, int segments = 64);

}  // namespace sqslam
