#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// A map point seen at a pixel.
struct PointObservation {
  Eigen::Vector3d p_map;
  Eigen::Vector2d pixel;  // undistorted
  double variance = 1.0;  // of the pixel, px^2
  bool inlier = true;     // in and out
};

// Refines T_camera_map so that the reprojection error of the observations becomes least (Huber, Gauss-Newton
// with analytic Jacobians, points fixed), and marks outliers; four rounds, each from the inliers of the last,
// as in the tracking of ORB-SLAM (Mur-Artal et al. 2015, section V). Returns the number of inliers.
int OptimizePose(const Camera& camera, std::vector<PointObservation>& observations, Rigid3d& T_camera_map);

}  // namespace sqslam
