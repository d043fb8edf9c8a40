#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// In DepthMap::views: no other depth map saw the pixel's surface; its depth is from a plane that its
// surroundings support.
inline constexpr std::uint8_t kFilledByPlane = 255;

// Depth of a keyframe's pixels. A value: its images never change once made (copies share them).
struct DepthMap {
  std::int64_t keyframe = 0;  // id
  std::int64_t frame_index = 0;
  Camera camera;  // without distortion, of the images below
  Rigid3d T_map_camera;
  cv::Mat depth;  // 32FC1, along the camera's z axis, map units; 0: unknown
  cv::Mat views;  // 8UC1, neighbouring depth maps that agree with the pixel, or kFilledByPlane
  cv::Mat bgr;    // 8UC3

  // Returns the point that a pixel with depth shows, map frame.
  Eigen::Vector3d PointAt(int x, int y) const {
    const double z = depth.at<float>(y, x);
    return T_map_camera * (z * camera.Unproject({static_cast<double>(x), static_cast<double>(y)}));
  }
};

}  // namespace sqslam
