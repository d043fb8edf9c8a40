#include "render/synthetic/scene_renderer.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkTexture.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "render/solids/poly_data.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

constexpr double kNear = 0.05;  // metres
constexpr double kFar = 30.0;

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

// Returns the pinhole camera that shows what a fisheye lens shows, as large in the middle.
Camera PinholeOf(const Camera& lens, int supersampling) {
  constexpr double kLargest = 16384.0;  // pixels, of a side of a picture that OpenGL draws
  if (lens.lens != LensModel::kFisheye) {
    return lens;
  }
  const auto [left, top, right, bottom] = lens.ShownBounds();
  ThrowIf<InputError>(
      std::max(right - left, bottom - top) * supersampling > kLargest,
      "'camera': the fisheye lens is too wide to be drawn; expected a larger fx or fewer pixels");
  Camera pinhole = lens.WithoutDistortion();
  pinhole.cx -= left;
  pinhole.cy -= top;
  pinhole.width = static_cast<int>(std::ceil(right - left)) + 1;
  pinhole.height = static_cast<int>(std::ceil(bottom - top)) + 1;
  return pinhole;
}

// Returns where the pinhole camera shows each pixel of the lens (32FC2), both pictures drawn larger.
cv::Mat BendOf(const Camera& lens, const Camera& pinhole, double supersampling) {
  if (lens.lens != LensModel::kFisheye) {
    return {};
  }
  const auto middle = [supersampling](int drawn) { return (drawn + 0.5) / supersampling - 0.5; };
  cv::Mat bend(cv::Size(lens.width, lens.height) * static_cast<int>(supersampling), CV_32FC2);
  cv::parallel_for_(cv::Range(0, bend.rows), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < bend.cols; ++column) {
        const Eigen::Vector3d ray = lens.Unproject(lens.Undistort({middle(column), middle(row)}));
        const Eigen::Vector2d pixel = supersampling * (pinhole.Project(ray).array() + 0.5) - 0.5;
        bend.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
      }
    }
  });
  return bend;
}

}  // namespace

SceneRenderer::SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend)
    : camera_(scene.camera),
      pinhole_(PinholeOf(camera_, supersampling)),
      supersampling_(supersampling),
      bend_(BendOf(camera_, pinhole_, supersampling)),
      window_({.width = pinhole_.width * supersampling_,
               .height = pinhole_.height * supersampling_,
               .backend = backend}) {
  window_.AddRenderer(color_renderer_);
  window_.AddRenderer(id_renderer_);
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

void SceneRenderer::Add(const TexturedMesh& mesh) {
  const auto data = PolyDataOf(mesh.vertices, mesh.triangles);
  data->GetPointData()->SetTCoords(TuplesOf<vtkFloatArray>(mesh.texture_coordinates));
  data->GetPointData()->SetScalars(TuplesOf<vtkUnsignedCharArray>(mesh.light));
  const auto add = [&data](vtkRenderer* renderer) {
    const vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    const vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->LightingOff();
    actor->GetProperty()->BackfaceCullingOn();
    renderer->AddActor(actor);
    return actor.Get();
  };
  add(color_renderer_)->SetTexture(MakeTexture(mesh.texture));
  vtkActor* id_actor = add(id_renderer_);
  id_actor->GetMapper()->ScalarVisibilityOff();
  id_actor->GetProperty()->SetColor(mesh.id / 255.0, mesh.id / 255.0, mesh.id / 255.0);
}

cv::Mat SceneRenderer::Render(vtkRenderer* drawn, vtkRenderer* other, const Rigid3d& T_world_camera) {
  SetPinholeCamera(pinhole_, T_world_camera, kNear, kFar, drawn->GetActiveCamera());
  drawn->DrawOn();
  other->DrawOff();
  return window_.Render();
}

cv::Mat SceneRenderer::RenderColor(const Rigid3d& T_world_camera) {
  cv::Mat image = Render(color_renderer_, id_renderer_, T_world_camera);
  if (!bend_.empty()) {
    cv::Mat bent;
    cv::remap(image, bent, bend_, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    image = bent;
  }
  if (supersampling_ > 1) {
    cv::resize(image, image, {camera_.width, camera_.height}, 0.0, 0.0, cv::INTER_AREA);
  }
  return image;
}

cv::Mat SceneRenderer::RenderIds(const Rigid3d& T_world_camera) {
  const cv::Mat image = Render(id_renderer_, color_renderer_, T_world_camera);
  cv::Mat ids;
  cv::extractChannel(image, ids, 0);
  if (!bend_.empty()) {
    cv::Mat bent;
    cv::remap(ids, bent, bend_, cv::noArray(), cv::INTER_NEAREST, cv::BORDER_REPLICATE);
    return bent;
  }
  return ids;
}

}  // namespace sqslam
