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

// Returns the points of the landmark that pass the paper's two tests (section "Outlier Removal"): votes and
// reprojection into `views`, and the isolation forest. Method "refined" also drops points of smaller objects
// and of surfaces that it may stand on. Updates landmark.votes (merges those of fused points, drops those of
// culled ones) and landmark.verdicts.
NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context);

// Returns the heights of the surfaces that an object with these points may stand on, from high to low.
SupportHeights PossibleSupports(const NamedPoints& points, const EstimationContext& context);

}  // namespace sqslam
