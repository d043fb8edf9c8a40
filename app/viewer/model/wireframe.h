#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"

namespace sqslam::viewer {

// A line of a solid as an image shows it: pixels with the lens's distortion, in order, not closed by itself.
struct WireLine {
  std::vector<Eigen::Vector2d> pixels;
  bool hidden = false;  // behind the solid itself: drawn faint
};

// The edges of a solid in an image, to be held against the photograph: of cuboids the twelve edges, of
// cylinders the two rims and the two sides of the outline, of ellipsoids and superquadrics the outline and
// the section through the middle. Parts behind the camera are cut off; parts beside the picture stay. Empty
// where the camera is inside of the solid.
std::vector<WireLine> ProjectWireframe(const Solid& solid, const Camera& camera, const Rigid3d& T_map_camera);

}  // namespace sqslam::viewer
