#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Similarity S_target_source that maps the source points onto the target points with the least squared
// distance, in closed form (Umeyama 1991). Points are paired by their order, in the units of their own
// frames. Empty where the pairs do not determine it: fewer than three, or all on one point or one straight
// line (in either set).
std::optional<Sim3d> AlignSimilarity(const std::vector<Eigen::Vector3d>& source,
                                     const std::vector<Eigen::Vector3d>& target);

}  // namespace sqslam
