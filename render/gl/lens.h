#pragma once

#include <Eigen/Core>
#include <array>

class vtkRenderer;

// The camera as the programs for the finished picture see it. For the sources of render/gl only.
namespace sqslam {

std::array<float, 4> Floats(const Eigen::Vector4d& v);

struct Lens {
  std::array<float, 4> terms{};  // P00, P11, P02, P12 of the projection
  std::array<float, 2> depth_range{};
  std::array<float, 4> ground{};  // the ground plane seen from the camera
  Eigen::Matrix4d T_device_map;   // to clip coordinates

  Lens(vtkRenderer* renderer, const Eigen::Vector4d& ground_map);
};

}  // namespace sqslam
