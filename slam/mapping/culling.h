#pragma once

#include <set>
#include <vector>

#include "slam/map/map.h"
#include "slam/mapping/loop_correction.h"
#include "slam/mapping/mapping_options.h"

namespace sqslam {

// Both rules are ORB-SLAM's (Mur-Artal et al. 2015, VI-B and VI-E).

// Removes young points that tracking hardly finds or that too few keyframes see; `young` loses those that are
// gone or have passed. Returns the number removed.
int CullPoints(Map& map, std::set<PointId>& young, KeyframeId newest, const CullingOptions& options);

// Removes keyframes near `center` whose points others see as well, but no end of a loop edge: later pose
// graphs need it. Returns the ones removed.
std::vector<KeyframeId> CullKeyframes(Map& map, KeyframeId center, const CullingOptions& options,
                                      const LoopEdges& loop_edges);

}  // namespace sqslam
