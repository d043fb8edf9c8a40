#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"

// Superquadrics as VTK's meshes. For the sources of render/ only.
namespace sqslam {

// The superquadric's surface (Eq. 1) in the object frame.
vtkSmartPointer<vtkPolyData> SuperquadricMesh(const Superquadric& shape, int segments);

// ---- Superquadrics that reach into one another, as one surface

struct ColoredSolid {
  PosedSuperquadric posed;
  Eigen::Vector3d color = Eigen::Vector3d::Zero();  // red, green, blue in [0, 1]
  int number = 0;                                   // what outlines tell apart
};

inline constexpr const char* kSolidNumberArray = "solid number";

// The surfaces in the map frame with normals, colours and the solid's number by vertex. No triangle is longer
// than a few steps of the grid: only small ones can be put in order by their centres.
struct GroupedSurface {
  vtkSmartPointer<vtkPolyData> mesh;
  std::vector<Eigen::Vector3d> centers;  // of the triangles, map frame
};
GroupedSurface MakeGroupedSurface(std::span<const ColoredSolid> solids, int segments);

// Puts the triangles in order for an eye, farthest first.
void SortTriangles(GroupedSurface& surface, const Eigen::Vector3d& eye);

}  // namespace sqslam
