#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "render/synthetic/lighting.h"
#include "render/synthetic/scene_description.h"

namespace sqslam {

// A mesh with its picture and its light, ready to be drawn without any further shading.
struct TexturedMesh {
  std::int32_t id = 0;                    // of the object, 0 for what has no ground truth
  std::vector<Eigen::Vector3f> vertices;  // world frame
  std::vector<Eigen::Vector3f> normals;
  std::vector<Eigen::Vector2f> texture_coordinates;  // [0, 1]; v = 0 at the last row of the picture
  std::vector<std::array<std::uint8_t, 3>> light;    // RGB, multiplies the texture
  std::vector<std::array<std::int32_t, 3>> triangles;
  cv::Mat texture;  // 8UC3, BGR
};

// A superquadric as three charts: the side unrolled as a label is around a can, and both caps seen from above
// and below. Each chart keeps lengths nearly true, so nothing is stretched.
std::vector<TexturedMesh> BuildBody(const SceneBody& body, const SceneLighting& lighting);

TexturedMesh BuildPanel(const ScenePanel& panel, const SceneLighting& lighting);

}  // namespace sqslam
