#pragma once

#include <Eigen/Core>

#include "slam/geometry/solid_iou.h"

namespace sqslam {

// Overlap of the outlines that two solids show when seen along `up` (unit vector of the solids'
// common frame), in [0, 1]: intersection over union of the areas of their orthographic shadows. What is left
// to say of a magazine 4 mm thick, whose 3D IoU is nothing as soon as it is mapped 4 mm too high.
// Polygons of 360 support points each, so that areas of round outlines are exact to 0.005 %. 0 where a size
// is not positive and finite.
double FootprintIoU(const Solid& a, const Solid& b, const Eigen::Vector3d& up);

}  // namespace sqslam
