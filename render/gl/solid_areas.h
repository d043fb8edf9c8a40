#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace sqslam {

// A box with its transform to OpenGL's clip coordinates.
struct ClipBox {
  Eigen::AlignedBox3d box;
  Eigen::Matrix4d T_clip_box;
};

// Rectangles, pixels from the lower left, that cover each pixel of a picture once.
struct SolidAreas {
  std::vector<cv::Rect> near_solids;
  std::vector<cv::Rect> elsewhere;
};

// Divides a picture into tiles that contain a part of a solid's bounding box, or come within `margin` pixels
// of one, and all other tiles. Ambient occlusion and outlines are then computed near solids only, which
// saves a third of the time of a software renderer. For the sources of render/gl only.
SolidAreas FindSolidAreas(std::span<const ClipBox> solids, cv::Size picture, double margin);

}  // namespace sqslam
