#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <opencv2/core.hpp>

#include "render/gl/offscreen_window.h"
#include "render/gl/picture_pass.h"
#include "render/scene/solid_meshes.h"

namespace sqslam {
namespace {

constexpr int kSide = 200;
const Eigen::Vector3d kEye(3.0, -5.0, 3.0);

// A bar through a ball beside a box that reaches into both.
std::vector<ColoredSolid> Tangle() {
  std::vector<ColoredSolid> solids(3);
  solids[0].posed.shape = {{1.6, 0.3, 0.3}, 0.2, 0.2};
  solids[0].color = {0.9, 0.2, 0.1};
  solids[1].posed.shape = {{0.8, 0.8, 0.8}, 1.0, 1.0};
  solids[1].color = {0.1, 0.3, 0.9};
  solids[2].posed.shape = {{0.5, 0.5, 0.9}, 0.3, 0.3};
  solids[2].posed.T_map_object.translation = {0.9, -0.4, -0.3};
  solids[2].color = {0.1, 0.7, 0.2};
  return solids;
}

vtkSmartPointer<vtkActor> Translucent(vtkPolyData* mesh) {
  const vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(mesh);
  const auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetLighting(false);
  actor->GetProperty()->SetOpacity(0.5);
  return actor;
}

cv::Mat Draw(vtkActor* actor, bool peel) {
  OffscreenWindow window({.width = kSide, .height = kSide, .backend = RenderBackend::kOsmesa});
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(1.0, 1.0, 1.0);
  renderer->AddActor(actor);
  vtkNew<PicturePass> pass;
  if (peel) {
    renderer->UseDepthPeelingOn();
    renderer->SetMaximumNumberOfPeels(20);
    renderer->SetOcclusionRatio(0.0);
  } else {
    actor->ForceOpaqueOn();  // as PicturePass wants its solids: blended, but with depth
    pass->SetEffects({.samples = 1});
    pass->SetLayers({.opaque = {}, .ground = {}, .solids = {actor}});
    renderer->SetPass(pass);
  }
  renderer->GetActiveCamera()->SetPosition(kEye.data());
  renderer->GetActiveCamera()->SetFocalPoint(0.0, 0.0, 0.0);
  renderer->GetActiveCamera()->SetViewUp(0.0, 0.0, 1.0);
  renderer->GetActiveCamera()->SetClippingRange(1.0, 20.0);
  window.AddRenderer(renderer);
  return window.Render();
}

double MeanDifference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * 3);
}

TEST(GroupedSurfaceTest, SortedTrianglesBlendAsPeeledLayersDo) {
  const std::vector<ColoredSolid> solids = Tangle();
  GroupedSurface surface = MakeGroupedSurface(solids, 96);
  const auto actor = Translucent(surface.mesh);
  SortTriangles(surface, kEye);
  const cv::Mat sorted = Draw(actor, false);
  SortTriangles(surface, -kEye);
  const cv::Mat wrongly_sorted = Draw(actor, false);
  const cv::Mat peeled = Draw(Translucent(surface.mesh), true);
  EXPECT_LT(MeanDifference(sorted, peeled), 0.5);  // of 255
  EXPECT_GT(MeanDifference(wrongly_sorted, peeled), 3.0);
}

TEST(GroupedSurfaceTest, NoTriangleIsLarge) {
  const std::vector<ColoredSolid> solids = Tangle();
  const GroupedSurface surface = MakeGroupedSurface(solids, 64);
  vtkCellArray* triangles = surface.mesh->GetPolys();
  ASSERT_EQ(static_cast<std::size_t>(triangles->GetNumberOfCells()), surface.centers.size());
  for (vtkIdType t = 0; t < triangles->GetNumberOfCells(); ++t) {
    vtkIdType size = 0;
    const vtkIdType* corners = nullptr;
    triangles->GetCellAtId(t, size, corners);
    for (int side = 0; side < 3; ++side) {
      const Eigen::Vector3d a(surface.mesh->GetPoint(corners[side]));
      const Eigen::Vector3d b(surface.mesh->GetPoint(corners[(side + 1) % 3]));
      ASSERT_LT((a - b).norm(), 0.21);
    }
  }
}

}  // namespace
}  // namespace sqslam
