#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/synthetic/scene_description.h"
#include "slam/geometry/box2.h"

namespace sqslam {

// The bounding box of the visible part of one object.
struct ExactBox {
  Detection detection;
  std::int32_t object_id = 0;
  double visible_fraction = 0.0;  // visible pixels / pixels of the whole silhouette, also outside the image
};

// Computes boxes from SceneRenderer::RenderIds' picture, in the order of the scene's objects, without those
// of which little is visible.
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
