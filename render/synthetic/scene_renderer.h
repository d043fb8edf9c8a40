#pragma once

#include <vtkNew.h>
#include <vtkRenderer.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/gl/offscreen_window.h"
#include "render/synthetic/scene_description.h"
#include "render/synthetic/textured_mesh.h"
#include "slam/geometry/box2.h"

namespace sqslam {

// Draws a scene as its camera sees it: through a lens with distortion by bending the picture of a pinhole
// camera that sees as much. For the sources of render/ only.
class SceneRenderer {
 public:
  // Paints the textures and computes the light, which takes seconds. Pictures are drawn at `supersampling`
  // times the camera's size, then averaged. Throws InputError if the lens is too wide for such a picture.
  SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend);

  cv::Mat RenderColor(const Rigid3d& T_world_camera);  // 8UC3, camera size

  // Returns the object id at each pixel (0: none): 8UC1, s = `supersampling` times the camera's size. Pixel
  // (i, j) covers the camera's columns [i / s - 0.5, (i + 1) / s - 0.5], and rows likewise.
  cv::Mat RenderIds(const Rigid3d& T_world_camera);

 private:
  void Add(const TexturedMesh& mesh);
  cv::Mat Render(vtkRenderer* drawn, vtkRenderer* other, const Rigid3d& T_world_camera, int interpolation);

  Camera camera_;
  Camera pinhole_;  // that the picture is drawn with; `camera_` itself if it has no distortion
  int supersampling_;
  cv::Mat bend_;  // of the pixels of a picture as the lens shows it: where `pinhole_` shows them; or empty
  OffscreenWindow window_;
  vtkNew<vtkRenderer> color_renderer_;
  vtkNew<vtkRenderer> id_renderer_;
};

// The bounding box of the visible part of one object.
struct ExactBox {
  Detection detection;
  std::int32_t object_id = 0;
  double visible_fraction = 0.0;  // visible pixels / pixels of the whole silhouette, also outside the image
};

// Computes boxes from SceneRenderer::RenderIds' picture, in the order of the scene's objects, leaving out
// objects that are barely visible.
std::vector<ExactBox> FindExactBoxes(const SceneDescription& scene, const Rigid3d& T_world_camera,
                                     const cv::Mat& ids, int supersampling);

// Perturbs exact boxes like a detector: edges with Gaussian noise of 3 % of the box's size, one box in ten
// missed, 3 % of the labels wrong, scores from 0.4 to 0.95.
class DetectorNoise {
 public:
  DetectorNoise(std::uint64_t seed, std::vector<std::string> labels);
  std::vector<Detection> Apply(const std::vector<ExactBox>& boxes, const Camera& camera);

 private:
  cv::RNG random_;
  std::vector<std::string> labels_;
};

}  // namespace sqslam
