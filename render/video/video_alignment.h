#pragma once

#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns the similarity S_target_map that aligns an earlier snapshot to a later one by their common
// keyframes: the map rotates when gravity becomes known and its scale may drift, which must not look like
// motion. The identity if they share fewer than two keyframes.
Sim3d AlignByKeyframes(const MapSnapshot& map, const MapSnapshot& target);

MapSnapshot Transformed(const Sim3d& S_target_map, const MapSnapshot& map);

}  // namespace sqslam
