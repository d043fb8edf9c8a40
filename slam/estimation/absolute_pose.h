#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// T_camera_map from points (map frame) and the undistorted pixels that show them, some of them wrong: P3P in
// closed form on samples of three, at most `iterations` of them (RANSAC, OpenCV's AP3P). `inliers`: indices
// of the pairs that agree within 4 px. Empty where no sample finds any.
std::optional<Rigid3d> LocateByP3P(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector2d>& pixels, int iterations,
                                   std::vector<int>& inliers);

}  // namespace sqslam
