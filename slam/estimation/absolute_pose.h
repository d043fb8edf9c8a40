#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// Estimates T_camera_map from points (map frame) and their undistorted pixels, with outliers: RANSAC with a
// closed-form P3P solver (OpenCV's AP3P) and at most `iterations` samples. `inliers`: indices of the pairs
// with errors below 4 px. Empty if no sample has any.
std::optional<Rigid3d> LocateByP3P(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector2d>& pixels, int iterations,
                                   std::vector<int>& inliers);

// Returns every T_camera_map, up to four, at which three points (map frame) appear at their undistorted
// pixels.
std::vector<Rigid3d> SolveP3P(const Camera& camera, const std::array<Eigen::Vector3d, 3>& points,
                              const std::array<Eigen::Vector2d, 3>& pixels);

}  // namespace sqslam
