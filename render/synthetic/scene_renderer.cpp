#include "render/synthetic/scene_renderer.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkTexture.h>
#include <vtkUnsignedCharArray.h>

#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "render/gl/offscreen_window.h"
#include "render/synthetic/textured_mesh.h"

namespace sqslam {
namespace {

constexpr double kNear = 0.05;  // metres
constexpr double kFar = 30.0;

vtkNew<vtkPolyData> MakePolyData(const TexturedMesh& mesh) {
  const auto count = static_cast<vtkIdType>(mesh.vertices.size());
  vtkNew<vtkPoints> points;
  points->SetNumberOfPoints(count);
  vtkNew<vtkFloatArray> coordinates;
  coordinates->SetNumberOfComponents(2);
  coordinates->SetNumberOfTuples(count);
  vtkNew<vtkUnsignedCharArray> light;
  light->SetNumberOfComponents(3);
  light->SetNumberOfTuples(count);
  for (vtkIdType i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    points->SetPoint(i, mesh.vertices[k].x(), mesh.vertices[k].y(), mesh.vertices[k].z());
    coordinates->SetTuple2(i, mesh.texture_coordinates[k].x(), mesh.texture_coordinates[k].y());
    light->SetTuple3(i, mesh.light[k][0], mesh.light[k][1], mesh.light[k][2]);
  }
  vtkNew<vtkCellArray> cells;
  for (const auto& triangle : mesh.triangles) {
    cells->InsertNextCell({triangle[0], triangle[1], triangle[2]});
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  data->GetPointData()->SetTCoords(coordinates);
  data->GetPointData()->SetScalars(light);
  return data;
}

vtkNew<vtkTexture> MakeTexture(const cv::Mat& bgr) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(bgr.cols, bgr.rows, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  cv::Mat bottom_up(bgr.rows, bgr.cols, CV_8UC3, image->GetScalarPointer());
  cv::cvtColor(bgr, bottom_up, cv::COLOR_BGR2RGB);
  cv::flip(bottom_up, bottom_up, 0);
  vtkNew<vtkTexture> texture;
  texture->SetInputData(image);
  texture->InterpolateOn();
  texture->MipmapOn();
  texture->RepeatOff();
  texture->EdgeClampOn();
  return texture;
}

}  // namespace

struct SceneRenderer::Impl {
  Impl(const SceneDescription& scene, int factor, RenderBackend backend)
      : camera(scene.camera),
        supersampling(factor),
        window({.width = camera.width * factor, .height = camera.height * factor, .backend = backend}) {
    window.AddRenderer(color_renderer);
    window.AddRenderer(id_renderer);
    const SceneLighting lighting(scene);
    const std::size_t panels = scene.panels.size();
    std::vector<std::vector<TexturedMesh>> meshes(panels + scene.bodies.size());
    cv::parallel_for_(cv::Range(0, static_cast<int>(meshes.size())), [&](const cv::Range& range) {
      for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
        meshes[i] = i < panels ? std::vector{BuildPanel(scene.panels[i], lighting)}
                               : BuildBody(scene.bodies[i - panels], lighting);
      }
    });
    for (const std::vector<TexturedMesh>& group : meshes) {
      for (const TexturedMesh& mesh : group) {
        Add(mesh);
      }
    }
  }

  void Add(const TexturedMesh& mesh) {
    const vtkNew<vtkPolyData> data = MakePolyData(mesh);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->SetTexture(MakeTexture(mesh.texture));
    actor->GetProperty()->LightingOff();
    actor->GetProperty()->BackfaceCullingOn();
    color_renderer->AddActor(actor);

    vtkNew<vtkPolyDataMapper> id_mapper;
    id_mapper->SetInputData(data);
    id_mapper->ScalarVisibilityOff();
    vtkNew<vtkActor> id_actor;
    id_actor->SetMapper(id_mapper);
    id_actor->GetProperty()->LightingOff();
    id_actor->GetProperty()->BackfaceCullingOn();
    id_actor->GetProperty()->SetColor(mesh.id / 255.0, mesh.id / 255.0, mesh.id / 255.0);
    id_renderer->AddActor(id_actor);
  }

  cv::Mat Render(vtkRenderer* drawn, vtkRenderer* other, const Rigid3d& T_world_camera) {
    SetPinholeCamera(camera, T_world_camera, kNear, kFar, drawn->GetActiveCamera());
    drawn->DrawOn();
    other->DrawOff();
    return window.Render();
  }

  Camera camera;
  int supersampling;
  OffscreenWindow window;
  vtkNew<vtkRenderer> color_renderer;
  vtkNew<vtkRenderer> id_renderer;
};

SceneRenderer::SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend)
    : impl_(std::make_unique<Impl>(scene, supersampling, backend)) {}
SceneRenderer::~SceneRenderer() = default;

cv::Mat SceneRenderer::RenderColor(const Rigid3d& T_world_camera) {
  cv::Mat image = impl_->Render(impl_->color_renderer, impl_->id_renderer, T_world_camera);
  if (impl_->supersampling > 1) {
    cv::resize(image, image, {impl_->camera.width, impl_->camera.height}, 0.0, 0.0, cv::INTER_AREA);
  }
  return image;
}

cv::Mat SceneRenderer::RenderIds(const Rigid3d& T_world_camera) {
  const cv::Mat image = impl_->Render(impl_->id_renderer, impl_->color_renderer, T_world_camera);
  cv::Mat ids;
  cv::extractChannel(image, ids, 0);
  return ids;
}

}  // namespace sqslam
