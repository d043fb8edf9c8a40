#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// A cloud in a frame that moves, turns and grows with it: whatever is computed there commutes with
// similarities of the cloud, and does not depend on the order of the points.
struct CanonicalCloud {
  Sim3d S_map_canonical;                // p_map = S * p_canonical
  std::vector<Eigen::Vector3d> points;  // canonical; sorted by their coordinates
  std::vector<std::size_t> source;      // index in the cloud of each of `points`
};

// Origin: a mean that far points pull little; axes: principal axes with the signs of the third moments; unit:
// the root mean square distance from the origin, likewise weighted. `upright` keeps the z axis and turns
// about it only. Throws InputError for fewer than 11 points, or points that all coincide.
CanonicalCloud ToCanonicalFrame(std::span<const Eigen::Vector3d> cloud, bool upright);

}  // namespace sqslam
