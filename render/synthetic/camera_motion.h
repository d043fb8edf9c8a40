#pragma once

#include <cstdint>
#include <vector>

#include "render/synthetic/scene_description.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// T_world_camera (x right, y down, z forward) that looks from `position` at `target`, upright.
Rigid3d LookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target);

// The way of a camera held by hand: through the scene's waypoints on a smooth curve at nearly even speed,
// slow at both ends, with a small tremor. One T_world_camera a frame; deterministic in the seed.
std::vector<Rigid3d> HandHeldMotion(const SceneDescription& scene, int frames, std::uint64_t seed);

}  // namespace sqslam
