#pragma once

#include <optional>
#include <span>
#include <vector>

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

struct StandingFit {
  PosedSuperquadric superquadric;
  std::optional<double> support;  // height of the surface that it stands on; empty: on none of them
  double cost = 0.0;              // robust, half the sum of squares
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  // see ObjectFit
};

// The joint refinement from several starts under several assumptions: that the object stands on one of
// `supports` (heights), or on none of them, which must then fit the boxes and points better by
// options.floating_cost. Starts are stretched down to the assumed support: the lower part of a chair behind a
// table is never seen. `only_promising`: a short look at a part of the data picks the starts and assumptions
// that are followed to the end, in about a third of the time.
StandingFit RefineStanding(std::span<const PosedSuperquadric> starts, RefinementInput input,
                           std::span<const double> supports, const RefinementOptions& options,
                           bool only_promising = false);

// Whether the lower box edges show where the object ends: where something hides them from nearly everywhere,
// the few other views missed what hides it.
bool IsBottomSeen(const std::vector<BoxView>& views);

// The same with its top where it was and its bottom at `height`.
PosedSuperquadric StretchedTo(PosedSuperquadric superquadric, double height);

// RefineStanding for a landmark with its inliers in landmark.points. `views`: those whose box edges are used.
// `thorough`: from all starts under all assumptions; otherwise on from the last result.
StandingFit RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views, bool thorough,
                           const EstimationContext& context);

}  // namespace sqslam
