#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_class.h"

namespace sqslam {

// Other landmarks that matter to the estimation of one.
struct Surroundings {
  std::vector<PosedSuperquadric> smaller;    // much smaller ones: points in them are not its own
  std::vector<PosedSuperquadric> others;     // all of them, which have tops of their own
  std::vector<const Landmark*> beneath;      // larger ones that hide nothing, as it is on top of them
  std::vector<PosedSuperquadric> occluders;  // larger ones of known size that may hide it
  std::optional<double> hidden_support;      // support of the nearest of these, which it may share
  std::optional<double> top_height;          // height of its top, on which smaller ones stand
};

// Collects the surroundings of a landmark from the shown landmarks, which may include itself. Empty if it has
// no estimate yet.
Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown,
                            const ClassTable& classes);

// Returns the horizontal way from `p_map` to the middle line of a table, which runs along the table and ends
// as far from its ends as from its sides: what stands at the table faces this way.
Eigen::Vector3d DirectionToTableAxis(const PosedSuperquadric& table, const Eigen::Vector3d& p_map);

}  // namespace sqslam
