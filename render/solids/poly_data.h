#pragma once

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <array>
#include <vector>

// Meshes for VTK. For the sources of render/ only.
namespace sqslam {

// Returns vectors of floats or bytes as an array with a tuple for each.
template <typename Array, typename Vector>
vtkSmartPointer<Array> TuplesOf(const std::vector<Vector>& vectors) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetNumberOfComponents(sizeof(Vector) / sizeof(typename Array::ValueType));
  array->SetNumberOfTuples(static_cast<vtkIdType>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    array->SetTypedTuple(static_cast<vtkIdType>(i), vectors[i].data());
  }
  return array;
}

// Returns a mesh without normals, colours or other attributes.
template <typename Index>
vtkSmartPointer<vtkPolyData> PolyDataOf(const std::vector<Eigen::Vector3f>& vertices,
                                        const std::vector<std::array<Index, 3>>& triangles) {
  const vtkNew<vtkPoints> points;
  points->SetData(TuplesOf<vtkFloatArray>(vertices));
  const vtkNew<vtkCellArray> cells;
  for (const auto& [a, b, c] : triangles) {
    cells->InsertNextCell({a, b, c});
  }
  auto mesh = vtkSmartPointer<vtkPolyData>::New();
  mesh->SetPoints(points);
  mesh->SetPolys(cells);
  return mesh;
}

}  // namespace sqslam
