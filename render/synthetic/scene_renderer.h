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
  // Paints the textures and computes the light: seconds. Pictures are drawn at `supersampling` times the
  // camera's size and averaged down.
  SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend);

  cv::Mat RenderColor(const Rigid3d& T_world_camera);  // 8UC3, camera size

  // The object that each point of the picture shows (0 for none): 8UC1, `supersampling` times the camera's
  // size. Its pixel (i, j) covers [i / s - 0.5, (i + 1) / s - 0.5] of the camera's columns, and so for rows.
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
