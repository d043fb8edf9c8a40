#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/objects/landmark.h"
#include "slam/objects/metric_scale.h"
#include "slam/objects/object_class.h"
#include "slam/objects/object_options.h"
#include "slam/objects/support.h"
#include "slam/objects/surroundings.h"

namespace sqslam {

struct StandingFit;  // landmark_refinement.h

struct EstimationContext {
  const ObjectOptions* options = nullptr;
  const PointLookup* points = nullptr;
  Camera camera;
  bool upright = false;
  const SupportSurfaces* supports = nullptr;
  double edge_information = 1.0;  // of the run's boxes, see EdgeInformation()
  Surroundings surroundings;      // of the landmark that is being estimated
  const ClassTable* classes = nullptr;
  std::optional<MetricScale> scale;  // of the map, from the other objects
  bool thorough = false;             // refine from all starts, not only from the last result
  std::uint64_t seed = 0;
};

// Runs all steps from observations to a superquadric: current point positions, outlier removal, yaw, size,
// shape, and with method "refined" the joint refinement. Leaves landmark.estimated false if the evidence is
// too weak.
void EstimateLandmark(Landmark& landmark, const EstimationContext& context);

// Makes `fit` the landmark's estimate and updates what is derived from it. `views`: those that it was fitted
// to.
void ApplyFit(Landmark& landmark, const StandingFit& fit, const std::vector<BoxView>& views,
              const EstimationContext& context);

// Mean IoU of the superquadric's projections and the boxes of the views, in [0, 1].
double BoxAgreement(const PosedSuperquadric& hull, const std::vector<SolidPart>& parts,
                    const std::vector<BoxView>& views, const Camera& camera);
double BoxAgreement(const PosedSuperquadric& superquadric, const std::vector<BoxView>& views,
                    const Camera& camera);

// Root mean square of the radial distances (Eq. 11) of the landmark's points, map units.
double PointRms(const Landmark& landmark, const PosedSuperquadric& solid);

// Selects at most `count` views spread over the camera positions (farthest-point sampling), in the order of
// their frames.
std::vector<BoxView> SpreadViews(const std::vector<BoxView>& views, int count);

// Returns the ids of the most outdated landmarks, at most `most` (0: no limit). The share of new boxes
// counts, as young landmarks change with every box and old ones hardly.
std::vector<int> MostOutdated(const std::map<int, Landmark>& landmarks, int most);

// Sorts the ids in the order of estimation, largest first: small objects profit from the new estimates of the
// large ones that hide or support them. The size is that of the class if it and the scale of the map are
// known, as estimates during a run may be far off; otherwise the mapped diagonal, as a table of which only
// the top was found has hardly a volume.
std::vector<int> LargestFirst(const std::map<int, Landmark>& landmarks, const std::vector<int>& ids,
                              const ClassTable& classes, const std::optional<MetricScale>& scale);

}  // namespace sqslam
