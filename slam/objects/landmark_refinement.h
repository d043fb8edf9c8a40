#pragma once

#include <optional>
#include <span>
#include <vector>

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"

namespace sqslam {

struct SurfacePoint;

struct StandingFit {
  PosedSuperquadric superquadric;
  std::optional<double> support;  // height of the surface that it stands on; empty: on none of them
  double cost = 0.0;              // robust, half the sum of squares
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  // see ObjectFit
};

// Heights of the surfaces that an object may stand on.
struct SupportHeights {
  std::vector<double> near;  // known to be around it
  std::vector<double> far;   // further ones below it, of which no point is near: they may go on unseen
};

enum class SearchEffort {
  kPromising,  // two starts are followed, picked by a short look at a part of the data: a third of the time
  kAll,        // all starts are followed
  kThorough,   // and far surfaces are tried, and the neighbourhood of the best
};

// The joint refinement from several starts under several assumptions: that the object stands on one of the
// surfaces, or on none of them, which must then fit the boxes and points better by options.floating_cost.
// Starts are stretched down to the assumed support: the lower part of a chair behind a table is never seen.
//
// Most of the many local minima differ by one side of the object, by an eighth of a turn or by the kind of
// shape. `kThorough` tries these from the best one, again and again until none is better.
StandingFit RefineStanding(std::span<const PosedSuperquadric> starts, RefinementInput input,
                           const SupportHeights& supports, const RefinementOptions& options,
                           SearchEffort effort);

// The superquadric with its top where it was and its bottom at `height`.
PosedSuperquadric StretchedTo(PosedSuperquadric superquadric, double height);

// True where the lower box edges show where the object ends. Where something hides them in nearly all views,
// the few other views have missed what hides it.
bool IsBottomSeen(const std::vector<BoxView>& views);

// Inliers that make a start; of an object with fewer its boxes do.
inline constexpr std::size_t kMinPoints = 4;

// RefineStanding for a landmark with its inliers in landmark.points. `views`: those whose box edges are used.
// `thorough`: from all starts under all assumptions (the more of them followed where the context is thorough
// as well); otherwise on from the last result. Empty where there are fewer than kMinPoints inliers and the
// boxes do not tell the place.
std::optional<StandingFit> RefineLandmark(const Landmark& landmark, const std::vector<BoxView>& views,
                                          bool thorough, const EstimationContext& context);

// The same from all starts, with points that lie on its surface, `sigma` (map units) precise.
StandingFit RefineLandmarkWithSurface(const Landmark& landmark, const std::vector<BoxView>& views,
                                      std::span<const SurfacePoint> surface, double sigma,
                                      const EstimationContext& context);

}  // namespace sqslam
