#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"

// Superquadrics as VTK meshes. For the sources of render/ only.
namespace sqslam {

// Returns the superquadric's surface (Eq. 1) in the object frame.
vtkSmartPointer<vtkPolyData> SuperquadricMesh(const Superquadric& shape, int segments);

// ---- Interpenetrating superquadrics as one surface

struct ColoredSolid {
  PosedSuperquadric posed;
  Eigen::Vector3d color = Eigen::Vector3d::Zero();  // red, green, blue in [0, 1]
  int number = 0;                                   // separates solids for outlines
};

inline constexpr const char* kSolidNumberArray = "solid number";

// The surfaces in the map frame with normals, colours and the solid's number per vertex. No triangle is
// longer than a few grid steps: only small ones can be sorted by their centres.
struct GroupedSurface {
  vtkSmartPointer<vtkPolyData> mesh;
  std::vector<Eigen::Vector3d> centers;  // of the triangles, map frame
};
GroupedSurface MakeGroupedSurface(std::span<const ColoredSolid> solids, int segments);

// Sorts the triangles for an eye position, farthest first.
void SortTriangles(GroupedSurface& surface, const Eigen::Vector3d& eye);

}  // namespace sqslam
