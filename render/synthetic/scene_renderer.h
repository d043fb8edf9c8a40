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

// A picture of a scene.
struct SceneImage {
  cv::Mat color;  // 8UC3, camera size

  // The object id at each pixel (0: none): 8UC1, s = `supersampling` times the camera's size. Pixel (i, j)
  // covers the camera's columns [i / s - 0.5, (i + 1) / s - 0.5], and rows likewise.
  cv::Mat ids;
};

// Draws a scene as its camera sees it: through a lens with distortion by bending the picture of a pinhole
// camera that sees as much. For the sources of render/ only.
class SceneRenderer {
 public:
  // Paints the textures and computes the light, which takes seconds. Pictures are drawn at `supersampling`
  // times the camera's size, then averaged. Throws InputError if the lens is too wide for such a picture.
  SceneRenderer(const SceneDescription& scene, int supersampling, RenderBackend backend);

  SceneImage Render(const Rigid3d& T_world_camera);

 private:
  void Add(const TexturedMesh& mesh);
  cv::Mat ThroughLens(const cv::Mat& drawn, int interpolation) const;

  Camera camera_;
  Camera pinhole_;  // that the picture is drawn with; `camera_` itself if it has no distortion
  int supersampling_;
  cv::Mat bend_;  // of the pixels of a picture as the lens shows it: where `pinhole_` shows them; or empty
  OffscreenWindow window_;
  vtkNew<vtkRenderer> renderer_;
};

// The bounding box of the visible part of one object.
struct ExactBox {
  Detection detection;
  std::int32_t object_id = 0;
  double visible_fraction = 0.0;  // visible pixels / pixels of the whole silhouette, also outside the image
};

// Computes boxes from SceneImage::ids, in the order of the scene's objects, leaving out
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
