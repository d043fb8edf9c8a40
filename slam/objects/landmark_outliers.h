#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_refinement.h"

namespace sqslam {

using NamedPoints = std::vector<std::pair<std::int64_t, Eigen::Vector3d>>;  // id and position, map frame

std::vector<Eigen::Vector3d> Positions(const NamedPoints& points);

// The points of the landmark that passed the paper's two tests (section "Outlier Removal"): by votes and
// reprojection into `views`, and by the isolation forest. With method "refined" also without those of smaller
// objects and of the surfaces that it may stand on. Renews landmark.votes: fused points are added, culled
// ones forgotten; and landmark.verdicts.
NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context);

// Heights of the surfaces that something with these points may stand on, from high to low.
SupportHeights PossibleSupports(const NamedPoints& points, const EstimationContext& context);

}  // namespace sqslam
