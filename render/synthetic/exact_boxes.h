#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/synthetic/scene_description.h"
#include "slam/geometry/box2.h"

namespace sqslam {

// The box of the visible part of one object.
struct ExactBox {
  Detection detection;
  std::int32_t object_id = 0;
  double visible_fraction = 0.0;  // visible pixels / pixels of the whole silhouette, also outside the image
};

struct ExactBoxOptions {
  double min_visible_fraction = 0.3;  // objects seen less are not listed
  double min_image_fraction = 0.001;  // nor those whose visible part is smaller, relative to the image
};

// Boxes from the id picture of SceneRenderer::RenderIds, in the order of the scene's objects.
std::vector<ExactBox> FindExactBoxes(const SceneDescription& scene, const Rigid3d& T_world_camera,
                                     const cv::Mat& ids, int supersampling,
                                     const ExactBoxOptions& options = {});

// Area in square pixels of an object's whole silhouette, 0 where a part of it lies behind the camera.
// Superquadrics with exponents up to 2 are convex, so the silhouette is the convex hull of the projected
// surface.
double SilhouetteArea(const PosedSuperquadric& superquadric, const Camera& camera,
                      const Rigid3d& T_world_camera);

// Exact boxes as a detector would give them: edges off by a normal error of 3 % of the box's size, one box in
// ten missed, 3 % of the labels wrong, scores from 0.4 to 0.95.
class DetectorNoise {
 public:
  DetectorNoise(std::uint64_t seed, std::vector<std::string> labels);
  std::vector<Detection> Apply(const std::vector<ExactBox>& boxes, const Camera& camera);

 private:
  cv::RNG random_;
  std::vector<std::string> labels_;
};

}  // namespace sqslam
