#pragma once

#include <Eigen/Geometry>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam::testing {

// 640x480 without distortion, 65 degrees wide.
inline Camera TestCamera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  return camera;
}

// Returns T_map_camera of an upright camera that looks at a point, map frame.
inline Rigid3d CameraLookingAt(const Eigen::Vector3d& target, const Eigen::Vector3d& position) {
  const Eigen::Vector3d forward = (target - position).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << right, forward.cross(right), forward;
  return {Eigen::Quaterniond(R), position};
}

}  // namespace sqslam::testing
