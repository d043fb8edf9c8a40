#pragma once

#include <optional>
#include <span>
#include <vector>

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/support_hypotheses.h"

namespace sqslam {

// The refinement under the likeliest hypothesis, whose cost counts in its own.
struct StandingFit : RefinementResult {
  Assumption assumption;
  MotionFit motion;    // of a search from several starts
  bool placed = true;  // false: no place lies in all boxes; the solid is only that of the least cost
};

enum class SearchEffort {
  kPromising,  // follows a few starts, picked by a short run on a part of the data: a third of the time
  kThorough,   // follows all starts, tries all far surfaces, and the neighbourhood of the best
};

// Runs the joint refinement from several starts under several hypotheses and returns the one with the most
// evidence: that the object stands on one of the surfaces, or on none, which is the rarer
// (options.floating_cost); and, of a seat whose lower part is hidden, that its boxes show the whole or the
// back alone. Starts are stretched down to the assumed support: the lower part of a chair behind a table is
// never seen.
//
// Most local minima differ by one side of the object, by an eighth of a turn or by the kind of shape.
// `kThorough` repeatedly tries these variants of the best one until none is better.
StandingFit RefineStanding(std::span<const PosedSuperquadric> starts, RefinementInput input,
                           const SupportHeights& supports, const RefinementOptions& options,
                           SearchEffort effort);

// Least number of inliers to start from; with fewer, the boxes are used.
inline constexpr std::size_t kMinPoints = 4;

// Runs RefineStanding for a landmark with its inliers in landmark.points. `views`: those whose box edges are
// used. `thorough`: from all starts under all hypotheses (with SearchEffort::kThorough if the context is
// thorough too); otherwise from the last result, on the surface that it stands on. Empty if there are fewer
// than kMinPoints inliers and fewer than options.min_observations boxes, which do not determine the position.
std::optional<StandingFit> RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views,
                                          bool thorough, const EstimationContext& context);

}  // namespace sqslam
