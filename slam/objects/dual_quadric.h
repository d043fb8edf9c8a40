#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_class.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// Objects as dual quadrics estimated from boxes alone: QuadricSLAM (Nicholson, Milford and Suenderhauf, IEEE
// RA-L 2019). An ellipsoid is stored as a superquadric with e1 = e2 = 1; it may have any orientation.

// Returns the symmetric Q* with pi^T Q* pi = 0 for every plane pi = (n, d), n . p + d = 0, that touches the
// ellipsoid; map frame, scaled so that its last entry is -1.
Eigen::Matrix4d DualQuadricOf(const PosedSuperquadric& ellipsoid);

// Inverts DualQuadricOf(), for Q* of any scale. Empty if Q* is not an ellipsoid (a squared half axis is not
// positive). The axes are named so that z is nearest to the map's z and x nearest to the map's x.
std::optional<PosedSuperquadric> EllipsoidOf(const Eigen::Matrix4d& dual_quadric);

// Priors of an upright ellipsoid whose yaw is known and whose longer horizontal axis is x.
struct QuadricPriors {
  ObjectClass known;     // of which the proportions count
  double support = 0.0;  // height of the plane that it stands on, map frame
};

// Refines an upright `start` so that it agrees with the boxes (step 2 below) and with the priors. Keeps its
// yaw and the naming of the axes. Empty if the result is not a bounded ellipsoid in front of the cameras.
std::optional<PosedSuperquadric> RefineDualQuadric(const PosedSuperquadric& start,
                                                   std::span<const BoxView> views, const Camera& camera,
                                                   const ObjectOptions& options, const QuadricPriors& priors);

// Returns a frame at the point nearest to the rays through the box centres, in which the median half diagonal
// of the boxes is 1: p_map = S * p. Empty if the rays are nearly parallel or the point is behind a camera.
std::optional<Sim3d> FrameOfBoxes(std::span<const BoxView> views, const Camera& camera);

// Estimates the ellipsoid of a landmark from its boxes:
//  1. Each box edge that shows where the object ends spans a plane pi = P^T l. The dual quadric minimises the
//     squares of pi^T Q* pi, in a frame centred at the object and scaled to its size.
//  2. If that is an ellipsoid, centre, rotation and half axes minimise the energy of the box edges
//     (object_energy.h): an edge that is hidden or cut off is a lower bound on the extent.
// Empty if the boxes do not determine a quadric (fewer than three views, or views from one place or along one
// line) or if the result is not bounded or not in front of the cameras. Commutes with similarities of the map
// frame.
std::optional<PosedSuperquadric> EstimateDualQuadric(std::span<const BoxView> views, const Camera& camera,
                                                     const ObjectOptions& options);

}  // namespace sqslam
