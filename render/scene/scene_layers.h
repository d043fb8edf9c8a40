#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace sqslam {

struct ColoredPoints {
  std::vector<Eigen::Vector3f> p_map;
  std::vector<std::array<std::uint8_t, 3>> rgb;  // as many as points, or none: in the style's colour
};

// Drawn with a map without being part of it, in its frame. A value; the cloud is shared.
struct SceneLayers {
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // of the camera, in pieces
  std::shared_ptr<const ColoredPoints> dense_cloud;     // or null

  bool operator==(const SceneLayers&) const = default;
};

}  // namespace sqslam
