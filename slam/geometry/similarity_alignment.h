#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Returns the similarity S_target_source that minimises the squared distances between mapped source points
// and target points, in closed form (Umeyama 1991). Points are paired by their order, in the units of their
// own frames. Empty if the pairs do not determine it: fewer than three, or all at one point or on one line
// (in either set).
std::optional<Sim3d> AlignSimilarity(const std::vector<Eigen::Vector3d>& source,
                                     const std::vector<Eigen::Vector3d>& target);

// Returns the similarity S_target_source that minimises the errors of positions and of orientations, each in
// units of their own root mean square. Cameras that move along a line determine the turn about it by their
// orientations only. Empty where AlignSimilarity is.
std::optional<Sim3d> AlignPoses(const std::vector<Rigid3d>& source, const std::vector<Rigid3d>& target);

}  // namespace sqslam
