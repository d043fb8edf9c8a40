#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/class_priors.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"
#include "slam/objects/support.h"
#include "slam/objects/surroundings.h"

namespace sqslam {

struct StandingFit;  // landmark_refinement.h

// Parts of an object that are known beforehand and replace what is estimated of them: for error budgets.
struct GivenParts {
  std::optional<double> yaw;      // radians about the map's z axis
  std::optional<double> support;  // height of what it stands on, map frame
  std::optional<ShapeKind> kind;
};

struct EstimationContext {
  const ObjectOptions* options = nullptr;
  const PointLookup* points = nullptr;
  Camera camera;
  bool upright = false;
  const SupportSurfaces* supports = nullptr;
  Surroundings surroundings;  // of the landmark that is being estimated
  const ClassPriors* classes = nullptr;
  std::optional<MetricScale> scale;  // of the map, by the other objects
  bool thorough = false;             // refine from all starts, not only on from the last result
  std::uint64_t seed = 0;
  GivenParts given = {};
};

// All steps from observations to a superquadric: current point positions, outlier removal, yaw, size, shape,
// and with method "refined" the joint refinement. Leaves landmark.estimated false where there are too few
// points.
void EstimateLandmark(Landmark& landmark, const EstimationContext& context);

// Makes `fit` the landmark's estimate, with what follows from it. `views`: those that it was fitted to.
void TakeFit(Landmark& landmark, const StandingFit& fit, const std::vector<BoxView>& views,
             const EstimationContext& context);

// Takes from the views' free edges those behind what is known by now to stand before the object: when the
// box was seen it may not have been mapped yet.
void MarkHiddenEdges(const Landmark& landmark, const EstimationContext& context, std::vector<BoxView>& views);

// At most `count` of the landmark's views that are not among `used`, evenly; `used` where there are hardly
// any.
std::vector<BoxView> HeldOutViews(const std::vector<BoxView>& all, const std::vector<BoxView>& used,
                                  std::size_t count);

// Says of an object whose class has a size what the map's scale is; empty for others.
std::optional<SizedObject> SizedBy(const Landmark& landmark, const ClassPriors& classes);

// Mean IoU of the superquadric's projections and the boxes of the views, in [0, 1].
double BoxAgreement(const PosedSuperquadric& superquadric, const std::vector<BoxView>& views,
                    const Camera& camera);

// Root mean square of the radial distances (Eq. 11) of the landmark's points, map units.
double PointRms(const Landmark& landmark, const PosedSuperquadric& solid);

// Views spread over the camera positions, at most `count`, in the order of their frames (farthest-point
// sampling).
std::vector<BoxView> SpreadViews(const std::vector<BoxView>& views, int count);

// Ids of the landmarks whose estimates are outdated, the most outdated ones, at most `most` (0: no limit).
// Young landmarks change with every box, old ones hardly: what counts is the share of new boxes.
std::vector<int> MostOutdated(const std::map<int, Landmark>& landmarks, int most);

// The ids in the order in which they are estimated, the largest first: small objects profit from what was
// just learnt of the large ones, what hides them and what they stand on.
std::vector<int> LargestFirst(const std::map<int, Landmark>& landmarks, const std::vector<int>& ids);

}  // namespace sqslam
