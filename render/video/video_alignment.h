#pragma once

#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The similarity S_target_map that lays an earlier snapshot over a later one by the keyframes they share: the
// map turns when gravity becomes known and its scale may drift, and neither should be seen as motion. The
// identity where they share fewer than two.
Sim3d AlignByKeyframes(const MapSnapshot& map, const MapSnapshot& target);

MapSnapshot Transformed(const Sim3d& S_target_map, const MapSnapshot& map);

}  // namespace sqslam
