#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/metric_scale.h"
#include "slam/objects/object_class.h"
#include "slam/objects/object_energy.h"
#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/objects/yaw.h"

namespace sqslam {

// A point on the object, with statistics of the cameras that observed it; map frame.
struct SeenPoint {
  Eigen::Vector3d p_map;
  Eigen::Vector3d mean_camera;  // of the camera centres
  double camera_spread = 0.0;   // root mean square distance of these from the line of sight, map units
};

// Hypothesis about what the object stands on and how much of it is seen.
struct Assumption {
  std::optional<double> support = {};  // z of the surface that it stands on; empty: none
  std::optional<double> lowest = {};   // lower bound on z of an object that stands on none
  double cost = 0.0;                   // half the chi square that it must save
  double sigma = 0.0;                  // standard deviation of the surface's height, map units
  bool shows_back = false;             // only the back of a seat is seen: the size is that of BackOf(prior)
};

struct RefinementInput {
  std::vector<SilhouetteView> views;
  std::vector<SeenPoint> points;     // inliers
  std::vector<YawMode> yaws;         // from lines; the one nearest to the start is used
  std::optional<double> top_height;  // z of its top, if other objects stand on it
  Camera camera;
  double edge_information = 1.0;  // see EdgeInformation()
  ObjectClass prior;
  bool may_show_back = false;  // something hides the lower part of a seat: perhaps only its back is seen
  std::optional<MetricScale> scale;  // empty: the prior's metric size is ignored
  Assumption assumption;

  bool ShowsBottom() const;  // in any view
};

struct RefinementResult {
  PosedSuperquadric superquadric;
  // kFull: negative log evidence, comparable between starts and hypotheses on the same measurements. kQuick:
  // half the sum of squares, less the log probability of the prior's modes.
  double cost = 0.0;
  Eigen::Matrix<double, 9, 9> covariance;  // of centre, half sizes, yaw, e1, e2; zero for kQuick
  std::vector<SolidPart> parts = {};       // empty: one solid
};

enum class RefinementDepth {
  kQuick,  // to rank starts: no covariance, no evidence, and too large boxes count less than too small
           // ones
  kFull,
};

// Refines centre, half sizes, yaw and shape jointly (9 parameters; roll and pitch stay zero), by
// Levenberg-Marquardt.
//
// The energy (object_energy.h) sums the terms of box edges, points, supports and the class. The ends of
// cylinders may be narrower than their middle.
// The prior has modes (kind of shape, longer horizontal axis, yaw), of which the one nearest to the start is
// used.
RefinementResult RefineJointly(const PosedSuperquadric& start, const RefinementInput& input,
                               const RefinementOptions& options,
                               RefinementDepth depth = RefinementDepth::kFull);

// Refines the object as the parts of the templates of its class whose hull is of this kind, and returns the
// best fit; empty if there are none. Costs are comparable with those of RefineJointly() from a start of the
// same kind.
std::optional<RefinementResult> RefineParts(PosedSuperquadric start, SolidKind kind,
                                            const RefinementInput& input, const RefinementOptions& options);

// Evidence that an object moves.
struct MotionFit {
  double gain = 0.0;  // half the chi square by which a solid that moves evenly fits better than one at rest
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // of that solid from the first view to the last
  PosedSuperquadric superquadric;                          // that solid, halfway
};

// Compares the solid at rest that RefineJointly() found for the same input with the better one of two that
// move evenly, which start there and at `start`: if no place lies in all boxes, the one at rest is far away.
// Of a motion along the camera's own straight path the boxes tell nothing but through size and contact.
MotionFit FitMotion(const PosedSuperquadric& at_rest, const PosedSuperquadric& start,
                    const RefinementInput& input, const RefinementOptions& options);

}  // namespace sqslam
