#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "render/gl/offscreen_context.h"
#include "render/synthetic/scene_description.h"

namespace sqslam {

// Draws a scene as its camera sees it.
class SceneRenderer {
 public:
  // Paints the textures and computes the light: seconds. Pictures are drawn at `supersampling` times the
  // camera's size and averaged down.
  SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend);
  ~SceneRenderer();

  cv::Mat RenderColor(const Rigid3d& T_world_camera);  // 8UC3, camera size

  // The object that each point of the picture shows (0 for none): 8UC1, `supersampling` times the camera's
  // size. Its pixel (i, j) covers [i / s - 0.5, (i + 1) / s - 0.5] of the camera's columns, and so for rows.
  cv::Mat RenderIds(const Rigid3d& T_world_camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
