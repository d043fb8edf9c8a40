#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <span>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// The nearest solid at each pixel of a picture.
struct SolidImage {
  cv::Mat1i number;  // its index; -1: none
  cv::Mat1f depth;   // of its surface along the viewing direction, map units; infinity: none
};

// Rasterises solids on the CPU, with a depth test. `camera`: a pinhole without distortion whose pixels'
// centres lie at whole numbers. Surfaces that reach behind the camera are left out there, and so are points
// for which `keeps` (null: everything) returns false, map frame.
SolidImage RasterizeSolids(std::span<const PosedSuperquadric> solids, const Camera& camera,
                           const Rigid3d& T_map_camera,
                           const std::function<bool(const Eigen::Vector3d&)>& keeps = nullptr);

}  // namespace sqslam
