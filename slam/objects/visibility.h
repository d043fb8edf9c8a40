#pragma once

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Whether the sphere around the object reaches into the view; quickly, and never false where a part of the
// object is seen and its centre is before the camera.
bool MayBeInView(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera, const Camera& camera);

}  // namespace sqslam
