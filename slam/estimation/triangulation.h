#pragma once

#include <Eigen/Core>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Point in the map frame from its viewing rays (z = 1, undistorted) in two cameras, by linear least squares
// (DLT).
Eigen::Vector3d Triangulate(const Rigid3d& T_camera1_map, const Eigen::Vector3d& ray1,
                            const Rigid3d& T_camera2_map, const Eigen::Vector3d& ray2);

// Cosine of the angle at p_map between the directions to two camera centres.
double CosParallax(const Eigen::Vector3d& p_map, const Eigen::Vector3d& center1,
                   const Eigen::Vector3d& center2);

}  // namespace sqslam
