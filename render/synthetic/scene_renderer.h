#pragma once

#include <vtkNew.h>
#include <vtkRenderer.h>

#include <opencv2/core.hpp>

#include "render/gl/offscreen_window.h"
#include "render/synthetic/scene_description.h"
#include "render/synthetic/textured_mesh.h"

namespace sqslam {

// Draws a scene as its camera sees it. For the sources of render/ only.
class SceneRenderer {
 public:
  // Paints the textures and computes the light, which takes seconds. Pictures are drawn at `supersampling`
  // times the camera's size, then averaged.
  SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend);

  cv::Mat RenderColor(const Rigid3d& T_world_camera);  // 8UC3, camera size

  // Returns the object id at each pixel (0: none): 8UC1, s = `supersampling` times the camera's size. Pixel
  // (i, j) covers the camera's columns [i / s - 0.5, (i + 1) / s - 0.5], and rows likewise.
  cv::Mat RenderIds(const Rigid3d& T_world_camera);

 private:
  void Add(const TexturedMesh& mesh);
  cv::Mat Render(vtkRenderer* drawn, vtkRenderer* other, const Rigid3d& T_world_camera);

  Camera camera_;
  int supersampling_;
  OffscreenWindow window_;
  vtkNew<vtkRenderer> color_renderer_;
  vtkNew<vtkRenderer> id_renderer_;
};

}  // namespace sqslam
