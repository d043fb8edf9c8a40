#pragma once

#include "slam/map/snapshot.h"

namespace sqslam {

// A made-up map: `objects` superquadrics of all shapes on a plane, `points` map points on and around them (a
// few far away), and keyframes on an arc. The same numbers give the same map.
MapSnapshot MakeSampleMap(int objects, int points);

}  // namespace sqslam
