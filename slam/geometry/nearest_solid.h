#pragma once

#include "slam/geometry/solid_iou.h"

namespace sqslam {

// Returns the ellipsoid, cylinder or cuboid that best approximates a superquadric: with the same centre and
// vertical axis, and with the half sizes of the largest 3D IoU instead of those of the superquadric, whose
// corners may reach far beyond it. A cuboid is rotated by 45 degrees about the z axis if that is much better:
// with e2 above 1 a side takes the place of an edge. Returns kSuperquadric unchanged.
PosedSuperquadric NearestOfKind(SolidKind kind, const PosedSuperquadric& superquadric);

}  // namespace sqslam
