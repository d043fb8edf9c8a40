#pragma once

#include "slam/geometry/solid_iou.h"

namespace sqslam {

// Returns the ellipsoid, cylinder or cuboid that best approximates a superquadric: with the same centre and
// vertical axis, and the half sizes that maximise the 3D IoU. (The corners of a solid with the superquadric's
// own half sizes may reach far beyond it.) A cuboid is rotated by 45 degrees about the z axis if that is
// clearly better: with e2 above 1 its sides replace the edges. Returns superquadrics unchanged for
// kSuperquadric.
PosedSuperquadric NearestOfKind(SolidKind kind, const PosedSuperquadric& superquadric);

}  // namespace sqslam
