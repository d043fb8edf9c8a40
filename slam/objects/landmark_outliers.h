#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

std::vector<Eigen::Vector3d> Positions(const NamedPoints& points);

// Returns the points of the landmark that pass the paper's two tests (section "Outlier Removal"): votes and
// reprojection into `views`, and the isolation forest. Method "refined" also drops points of smaller objects
// and of surfaces that it may stand on. Updates landmark.votes (merges those of fused points, drops those of
// culled ones) and landmark.verdicts.
NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context);

// Merges the votes of fused points and drops those of culled ones, if the landmark has far more votes than at
// its last estimation. An object is estimated anew only when its boxes have grown by a share, so points that
// come and go would pile up in a long run.
void ForgetGonePoints(Landmark& landmark, const PointLookup& lookup);

}  // namespace sqslam
