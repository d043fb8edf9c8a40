#pragma once

#include "slam/geometry/camera.h"

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

}  // namespace sqslam::testing
