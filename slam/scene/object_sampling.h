#pragma once

#include <random>

#include "slam/geometry/superquadric.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Draws a solid from the covariance of an object's centre, half sizes, yaw and exponents.
PosedSuperquadric SampleOf(const SnapshotObject& object, std::mt19937& random);

}  // namespace sqslam
