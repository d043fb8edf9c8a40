#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The order in which to draw translucent superquadrics so that nearer ones cover farther ones: indices,
// farthest first. Two convex solids that a plane separates can always be ordered: the one on the camera's
// side of the plane is drawn later. The plane is sought among the directions of centres and axes; solids that
// overlap are split where they overlap least. The order depends on the solids alone, not on how they are
// numbered.
std::vector<int> BackToFront(const std::vector<PosedSuperquadric>& solids,
                             const Eigen::Vector3d& camera_position);

// Largest n . (p - centre) over the solid, n a unit vector in the map frame (support function; the dual of
// the norm of Eq. 2).
double SupportExtent(const PosedSuperquadric& solid, const Eigen::Vector3d& n);

}  // namespace sqslam
