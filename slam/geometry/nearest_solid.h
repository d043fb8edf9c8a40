#pragma once

#include "slam/geometry/solid_iou.h"

namespace sqslam {

// The ellipsoid, cylinder or cuboid that takes up the same space as a superquadric as far as it can: about
// the same centre, upright as it, with the half sizes of the largest 3D IoU, not with those of the
// superquadric, whose corners may reach far beyond it. A cuboid is turned by 45 degrees about the z axis
// where that is much better: an exponent e2 above 1 makes a side of what was an edge. Returns kSuperquadric
// as it is.
PosedSuperquadric NearestOfKind(SolidKind kind, const PosedSuperquadric& superquadric);

}  // namespace sqslam
