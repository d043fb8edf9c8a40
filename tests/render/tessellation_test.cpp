#include "render/solids/tessellation.h"

#include <gtest/gtest.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSuperquadricSource.h>

#include <numbers>

#include "tests/support/surface_area.h"

namespace sqslam {
namespace {

double MeshVolume(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto vertex = [&](std::int32_t i) {
      return mesh.vertices[static_cast<std::size_t>(i)].cast<double>();
    };
    volume += vertex(a).dot(vertex(b).cross(vertex(c))) / 6.0;
  }
  return volume;
}

double MeshArea(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto vertex = [&](std::int32_t i) {
      return mesh.vertices[static_cast<std::size_t>(i)].cast<double>();
    };
    area += 0.5 * (vertex(b) - vertex(a)).cross(vertex(c) - vertex(a)).norm();
  }
  return area;
}

class TessellationTest : public testing::TestWithParam<std::pair<double, double>> {
 protected:
  Superquadric shape_{{0.3, 0.5, 0.8}, GetParam().first, GetParam().second};
};

TEST_P(TessellationTest, EnclosesVolumeAndAreaOfClosedForms) {
  const TriangleMesh mesh = Tessellate(shape_, 256);
  EXPECT_NEAR(MeshVolume(mesh) / shape_.Volume(), 1.0, 2e-3);
  EXPECT_NEAR(MeshArea(mesh) / SurfaceArea(shape_), 1.0, 5e-3);
}

TEST_P(TessellationTest, PlacesVerticesOnSurfaceWithOutwardNormals) {
  const TriangleMesh mesh = Tessellate(shape_);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d p = mesh.vertices[i].cast<double>();
    const Eigen::Vector3d n = mesh.normals[i].cast<double>();
    EXPECT_NEAR(shape_.RadialScale(p), 1.0, 1e-5);
    EXPECT_NEAR(n.norm(), 1.0, 1e-5);
    EXPECT_GT(n.dot(p), 0.0);
  }
}

TEST_P(TessellationTest, MatchesVtkSourceVertexByVertex) {
  // VTK's axis of the profile is y by default; with z as its axis, phi is e1 and theta is e2.
  vtkNew<vtkSuperquadricSource> source;
  source->SetAxisOfSymmetry(2);
  source->SetPhiRoundness(shape_.e1);
  source->SetThetaRoundness(shape_.e2);
  source->SetSize(1.0);
  source->SetScale(shape_.half_size.x(), shape_.half_size.y(), shape_.half_size.z());
  source->SetThetaResolution(64);
  source->SetPhiResolution(32);
  source->ToroidalOff();
  source->Update();
  vtkPolyData* theirs = source->GetOutput();
  ASSERT_GT(theirs->GetNumberOfPoints(), 1000);
  for (vtkIdType i = 0; i < theirs->GetNumberOfPoints(); ++i) {
    const Eigen::Vector3d p(theirs->GetPoint(i));
    EXPECT_NEAR(shape_.RadialScale(p), 1.0, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, TessellationTest,
                         testing::Values(std::pair(0.1, 0.1), std::pair(0.1, 1.0), std::pair(1.0, 1.0),
                                         std::pair(0.5, 0.7), std::pair(1.5, 0.3), std::pair(1.9, 1.9)));

TEST(SuperellipseTest, SamplesPolarAnglesOnSuperellipse) {
  for (const SuperellipsePoint& p : SampleUniformInPolarAngle(0.4, 0.0, 0.5 * std::numbers::pi, 8)) {
    EXPECT_NEAR(std::pow(p.x, 2.0 / 0.4) + std::pow(p.y, 2.0 / 0.4), 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace sqslam
