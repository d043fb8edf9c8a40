#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

namespace sqslam {

constexpr double kLoopSearchRadius = 8.0;  // px at level 0, of the search for points that verifies a loop

// A keyframe that shows the same place as an older one, without a covisibility link between them yet.
struct LoopCandidate {
  KeyframeId current = kNoKeyframe;
  KeyframeId known = kNoKeyframe;  // in the same map or in another one
  Sim3d S_current_known;  // from the known camera frame to the current one, each in the units of its map
  std::vector<PointId> known_points;               // seen by the known keyframe and its neighbours
  std::vector<std::pair<PointId, int>> confirmed;  // those matched in the current keyframe, with the keypoint
};

// Checks by geometry that two keyframes show the same place (ORB-SLAM, Mur-Artal et al. 2015, VII B, and
// ORB-SLAM3, Campos et al. 2021, VI A): estimates the similarity from matched descriptors, refines it with
// the points that each keyframe finds where the other predicts them. Then the current keyframe must match
// a minimum share of the known side's points in view, and enough neighbours of either keyframe as large a
// share of the other side's, since one object may stand in two places. Empty if one of these checks fails.
std::optional<LoopCandidate> VerifyLoop(const Camera& camera, const LoopOptions& options, const Map& map,
                                        const Keyframe& current, const Map& known_map, const Keyframe& known);

}  // namespace sqslam
