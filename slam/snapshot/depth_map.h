#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// In DepthMap::views: no other depth map saw the pixel's surface; its depth is from a plane that its
// surroundings support.
inline constexpr std::uint8_t kFilledByPlane = 255;

inline constexpr double kUnknownSigma = 0.01;  // of the depths of a map that predicts none, share of them

// Depth of a keyframe's pixels. A value: its images never change once made (copies share them).
struct DepthMap {
  std::int64_t keyframe = 0;  // id
  std::int64_t frame_index = 0;
  Camera camera;  // without distortion, of the images below
  Rigid3d T_map_camera;
  cv::Mat depth;  // 32FC1, along the camera's z axis, map units; 0: unknown
  cv::Mat sigma;  // 32FC1, predicted standard deviation of the depth, share of it; empty: unknown
  cv::Mat views;  // 8UC1, neighbouring depth maps that agree with the pixel, or kFilledByPlane
  cv::Mat bgr;    // 8UC3

  // Returns the predicted standard deviation of a pixel's depth as a share of it.
  double SigmaAt(int x, int y) const { return sigma.empty() ? kUnknownSigma : sigma.at<float>(y, x); }

  // Returns the point that a pixel with depth shows, map frame.
  Eigen::Vector3d PointAt(int x, int y) const {
    const double z = depth.at<float>(y, x);
    return T_map_camera * (z * camera.Unproject({static_cast<double>(x), static_cast<double>(y)}));
  }
};

// A truncated signed distance function on a voxel grid, stored in blocks around the surface only (Curless and
// Levoy, SIGGRAPH 1996; blocks as in Niessner et al., SIGGRAPH Asia 2013). A value.
struct SurfaceVolume {
  static constexpr int kEdge = 8;  // voxels along a block

  struct Voxel {
    float distance = 1.0F;  // from the surface in truncations, -1 to 1, positive towards the cameras
    float weight = 0.0F;    // 0: no camera saw it
    std::array<std::uint16_t, 3> rgb{};  // mean colour, in 256ths of a grey level
  };
  using Block = std::array<Voxel, static_cast<std::size_t>(kEdge* kEdge* kEdge)>;  // [z][y][x]
  using Place = std::array<std::int32_t, 3>;  // of a block, in blocks from the map's origin

  double voxel = 0.0;         // edge, map units; voxel (i, j, k) has its centre at voxel * (i, j, k)
  std::vector<Place> places;  // ascending
  std::vector<Block> blocks;  // one for each place

  static std::size_t IndexOf(int x, int y, int z) {
    return static_cast<std::size_t>((z * kEdge + y) * kEdge + x);
  }
};

}  // namespace sqslam
