#include "render/scene/solid_meshes.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "render/solids/poly_data.h"
#include "render/solids/tessellation.h"

namespace sqslam {
namespace {

// Splits triangles at their longest sides until none is longer than `longest`.
void Refine(TriangleMesh& mesh, float longest) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
  const auto middle_of = [&](std::int32_t a, std::int32_t b) {
    const auto [at, added] = middles.try_emplace(std::minmax(a, b), 0);
    if (added) {
      const auto i = static_cast<std::size_t>(a);
      const auto j = static_cast<std::size_t>(b);
      at->second = static_cast<std::int32_t>(mesh.vertices.size());
      mesh.vertices.push_back(0.5F * (mesh.vertices[i] + mesh.vertices[j]));
      mesh.normals.push_back((mesh.normals[i] + mesh.normals[j]).normalized());
    }
    return at->second;
  };
  for (std::size_t t = 0; t < mesh.triangles.size();) {
    const std::array<std::int32_t, 3> corners = mesh.triangles[t];
    std::size_t side = 0;
    float length = 0.0F;
    for (std::size_t s = 0; s < 3; ++s) {
      const auto a = static_cast<std::size_t>(corners[s]);
      const auto b = static_cast<std::size_t>(corners[(s + 1) % 3]);
      const float l = (mesh.vertices[a] - mesh.vertices[b]).norm();
      side = l > length ? s : side;
      length = std::max(length, l);
    }
    if (length <= longest) {
      ++t;
      continue;
    }
    const std::int32_t a = corners[side];
    const std::int32_t b = corners[(side + 1) % 3];
    const std::int32_t c = corners[(side + 2) % 3];
    const std::int32_t m = middle_of(a, b);
    mesh.triangles[t] = {a, m, c};
    mesh.triangles.push_back({m, b, c});
  }
}
}  // namespace

vtkSmartPointer<vtkPolyData> SuperquadricMesh(const Superquadric& shape, int segments) {
  const TriangleMesh surface = Tessellate(shape, std::max(8, segments / 4 * 4));
  auto mesh = PolyDataOf(surface.vertices, surface.triangles);
  mesh->GetPointData()->SetNormals(TuplesOf<vtkFloatArray>(surface.normals));
  return mesh;
}

GroupedSurface MakeGroupedSurface(std::span<const ColoredSolid> solids, int segments) {
  TriangleMesh whole;  // in the map frame
  std::vector<Eigen::Matrix<unsigned char, 3, 1>> colors;
  const vtkNew<vtkFloatArray> numbers;
  numbers->SetName(kSolidNumberArray);
  GroupedSurface surface;
  for (const ColoredSolid& solid : solids) {
    TriangleMesh mesh = Tessellate(solid.posed.shape, segments / 4 * 4);
    Refine(mesh, static_cast<float>(8.0 * solid.posed.shape.half_size.maxCoeff() / segments));
    const auto first = static_cast<std::int32_t>(whole.vertices.size());
    colors.resize(colors.size() + mesh.vertices.size(),
                  (255.0 * solid.color).array().round().cast<unsigned char>());
    std::vector<Eigen::Vector3d> placed;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      placed.push_back(solid.posed.T_map_object * mesh.vertices[i].cast<double>());
      whole.vertices.push_back(placed.back().cast<float>());
      whole.normals.push_back(
          (solid.posed.T_map_object.rotation * mesh.normals[i].cast<double>()).cast<float>());
      numbers->InsertNextValue(static_cast<float>(solid.number));
    }
    for (const auto& t : mesh.triangles) {
      whole.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const std::int32_t corner : t) {
        sum += placed[static_cast<std::size_t>(corner)];
      }
      surface.centers.push_back(sum / 3.0);
    }
  }
  surface.mesh = PolyDataOf(whole.vertices, whole.triangles);
  surface.mesh->GetPointData()->SetNormals(TuplesOf<vtkFloatArray>(whole.normals));
  surface.mesh->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(colors));
  surface.mesh->GetPointData()->AddArray(numbers);
  return surface;
}

void SortTriangles(GroupedSurface& surface, const Eigen::Vector3d& eye) {
  const std::size_t count = surface.centers.size();
  std::vector<double> distances(count);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = 0; i < count; ++i) {
    distances[i] = (surface.centers[i] - eye).squaredNorm();
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return distances[a] > distances[b]; });
  vtkCellArray* before = surface.mesh->GetPolys();
  const vtkNew<vtkCellArray> sorted;
  sorted->AllocateEstimate(static_cast<vtkIdType>(count), 3);
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(count);
  for (const std::size_t i : order) {
    vtkIdType size = 0;
    const vtkIdType* corners = nullptr;
    before->GetCellAtId(static_cast<vtkIdType>(i), size, corners);
    sorted->InsertNextCell(size, corners);
    centers.push_back(surface.centers[i]);
  }
  surface.mesh->SetPolys(sorted);
  surface.centers = std::move(centers);
}
}  // namespace sqslam
