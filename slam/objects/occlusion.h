#pragma once

#include <array>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Whether `other` can be what ends the view of `object`: much larger, so that its place is known better than
// their sizes differ, and not what the object lies on: that is beside it, or reaches below its middle.
bool MayHide(const PosedSuperquadric& other, const PosedSuperquadric& object);

// Which edges of a box (undistorted px: left, top, right, bottom) around something at `depth` (map units
// along the optical axis) end because `other` stands before it: just outside the edge the line of sight meets
// `other` first, and not so outside the opposite edge as well.
std::array<bool, 4> EdgesHiddenBy(const Box2d& box, double depth, const Rigid3d& T_map_camera,
                                  const Camera& camera, const PosedSuperquadric& other);

}  // namespace sqslam
