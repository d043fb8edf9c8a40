#pragma once

#include <vector>

#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/standing_fit.h"

namespace sqslam {

// Whether the lower box edges show where the object ends: where something hides them from nearly everywhere,
// the few other views missed what hides it.
bool IsBottomSeen(const std::vector<BoxView>& views);

// RefineStanding for a landmark with its inliers in landmark.points. `views`: those whose box edges are used.
// `thorough`: from all starts under all assumptions (the more of them followed where the context is thorough
// as well); otherwise on from the last result.
StandingFit RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views, bool thorough,
                           const EstimationContext& context);

}  // namespace sqslam
