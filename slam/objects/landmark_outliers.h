#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

using NamedPoints = std::vector<std::pair<std::int64_t, Eigen::Vector3d>>;  // id and position, map frame

std::vector<Eigen::Vector3d> Positions(const NamedPoints& points);

// A vote on a point of an object: the views in whose boxes it lies, and all that tell whether it does. Beyond
// an edge of a box that is not free, the object may continue.
struct BoxVotes {
  int inside = 0;
  int seen = 0;

  // `margin`: of a box, as share of its size. Unless the comparison is in undistorted pixels, points outside
  // the image get no vote.
  static std::vector<BoxVotes> Of(const std::vector<Eigen::Vector3d>& points,
                                  const std::vector<BoxView>& views, const Camera& camera, double margin,
                                  bool undistorted);
};

// Returns the points of the landmark that pass the paper's two tests (section "Outlier Removal"): votes and
// reprojection into `views`, and the isolation forest. Method "refined" also drops points of smaller objects
// and of surfaces that it may stand on. Updates landmark.votes (merges those of fused points, drops those of
// culled ones) and landmark.verdicts.
NamedPoints RemoveOutliers(Landmark& landmark, const std::vector<BoxView>& views,
                           const EstimationContext& context);

// Does the same to the votes of a landmark with far more of them than at its last estimation: as an object is
// estimated anew only when its boxes have grown by a share, points that come and go would pile up in a long
// run.
void ForgetGonePoints(Landmark& landmark, const PointLookup& lookup);

}  // namespace sqslam
