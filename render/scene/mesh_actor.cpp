#include "render/scene/mesh_actor.h"

#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkShaderProperty.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>

#include "picture_shaders.h"
#include "render/solids/poly_data.h"

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

vtkSmartPointer<vtkPolyData> Geometry(const SurfaceMesh& mesh) {
  auto data = PolyDataOf(mesh.vertices, mesh.triangles);
  data->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(mesh.rgb));
  data->GetPointData()->SetNormals(TuplesOf<vtkFloatArray>(NormalsOf(mesh)));
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
