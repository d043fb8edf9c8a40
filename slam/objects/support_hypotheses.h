#pragma once

#include <optional>
#include <vector>

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_outliers.h"

namespace sqslam {

// Heights of the surfaces that an object may stand on.
struct SupportHeights {
  // The top of a mapped object under it.
  struct Top {
    double height = 0.0;
    double sigma = 0.0;  // its standard deviation
  };

  std::vector<double> near;          // that have points around it
  std::vector<double> far;           // others below it without points nearby, where they may extend unseen
  std::optional<double> floor = {};  // empty if it was not found: no surface is known to be the floor
  std::vector<Top> tops = {};        // where no surface was found: few points may lie there
  double sigma = 0.0;                // standard deviation of the surfaces' heights

  double SigmaOf(double height) const;  // of a surface or a top
};

// Returns the surfaces that an object with these points may stand on, from high to low.
SupportHeights PossibleSupports(const NamedPoints& points, const EstimationContext& context);

// Returns the present height of the surface that the landmark's visible part was found to stand on. The
// surface may have moved with the map, or have been found no more.
std::optional<double> SupportOf(const Landmark& landmark, const SupportHeights& supports);

// Returns the height below which an object that stands on none of the surfaces does not reach; furniture may
// reach down to a floor that was not found.
std::optional<double> LowestOf(const SupportHeights& supports, const ObjectClass& prior);

// Returns the hypotheses for an object. `all_far`: with all far surfaces, not only those above the lowest
// near one and the floor of furniture.
std::vector<Assumption> Assumptions(const SupportHeights& supports, const RefinementInput& input,
                                    const RefinementOptions& options, bool all_far);

}  // namespace sqslam
