#include "render/scene/mesh_actor.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>

#include "picture_shaders.h"

namespace sqslam {
namespace {

// Returns area-weighted vertex normals.
std::vector<Eigen::Vector3f> NormalsOf(const SurfaceMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f twice_area =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const std::uint32_t corner : {a, b, c}) {
      normals[corner] += twice_area;
    }
  }
  for (Eigen::Vector3f& normal : normals) {
    normal.normalize();
  }
  return normals;
}

vtkNew<vtkPolyData> Geometry(const SurfaceMesh& mesh) {
  const auto count = static_cast<vtkIdType>(mesh.vertices.size());
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> normals;
  vtkNew<vtkUnsignedCharArray> colors;
  points->SetNumberOfPoints(count);
  normals->SetNumberOfComponents(3);
  normals->SetNumberOfTuples(count);
  colors->SetNumberOfComponents(3);
  colors->SetNumberOfTuples(count);
  const std::vector<Eigen::Vector3f> directions = NormalsOf(mesh);
  for (vtkIdType i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    points->SetPoint(i, mesh.vertices[at].x(), mesh.vertices[at].y(), mesh.vertices[at].z());
    normals->SetTypedTuple(i, directions[at].data());
    colors->SetTypedTuple(i, mesh.rgb[at].data());
  }
  vtkNew<vtkCellArray> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    triangles->InsertNextCell({a, b, c});
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(triangles);
  data->GetPointData()->SetScalars(colors);
  data->GetPointData()->SetNormals(normals);
  return data;
}

}  // namespace

vtkSmartPointer<vtkActor> MakeMeshActor(const SurfaceMesh& mesh, vtkPlaneCollection* clip) {
  const vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(Geometry(mesh));
  mapper->SetClippingPlanes(clip);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->ForceOpaqueOn();
  actor->GetProperty()->BackfaceCullingOn();
  actor->GetShaderProperty()->AddFragmentShaderReplacement("//VTK::Light::Impl", true, shaders::kPhotographed,
                                                           false);
  return actor;
}

void ShowUntil(std::int64_t frame, const SurfaceMesh& mesh, vtkActor& actor) {
  vtkPolyData* data = vtkPolyDataMapper::SafeDownCast(actor.GetMapper())->GetInput();
  const vtkNew<vtkCellArray> triangles;
  for (const auto& [a, b, c] : mesh.triangles) {
    if (mesh.frames[a] <= frame && mesh.frames[b] <= frame && mesh.frames[c] <= frame) {
      triangles->InsertNextCell({a, b, c});
    }
  }
  actor.SetVisibility(triangles->GetNumberOfCells() > 0);
  data->SetPolys(triangles);
}

}  // namespace sqslam
