#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// Objects as dual quadrics estimated from boxes alone: QuadricSLAM (Nicholson, Milford and Suenderhauf, IEEE
// RA-L 2019). An ellipsoid is held as a superquadric with e1 = e2 = 1; unlike other objects it may lean in
// any direction.

// The symmetric Q* with pi^T Q* pi = 0 for every plane pi = (n, d), n . p + d = 0, that touches the
// ellipsoid; map frame, scaled so that its last entry is -1.
Eigen::Matrix4d DualQuadricOf(const PosedSuperquadric& ellipsoid);

// The inverse, for Q* of any scale. Empty where Q* is another kind of quadric (a half axis squared is not
// positive). Of the ways to name the axes it takes the one with z nearest to the map's z and x nearest to the
// map's x.
std::optional<PosedSuperquadric> EllipsoidOf(const Eigen::Matrix4d& dual_quadric);

// Knowledge of an ellipsoid before its boxes, beside that it stands upright.
struct QuadricPriors {
  double log_width_ratio = 0.0;  // of the x over the y axis, natural logarithm
  double width_sigma = 1.0;
  double log_height_ratio = 0.0;  // of the z axis over the geometric mean of the others
  double height_sigma = 1.0;
  double support = 0.0;    // height of the plane that it touches from above, map frame
  bool keeps_yaw = false;  // that of the start
};

// The ellipsoid near `start` whose visible parts' boxes agree with those of the views, and with the priors
// where there are some (step 2 below). Its axes are those of the start, turned. Empty where it is no bounded
// ellipsoid before the cameras.
std::optional<PosedSuperquadric> RefineDualQuadric(const PosedSuperquadric& start,
                                                   std::span<const BoxView> views, const Camera& camera,
                                                   const ObjectOptions& options,
                                                   const std::optional<QuadricPriors>& priors);

// A frame about the place that the boxes show, in which their median half diagonal is 1: p_map = S * p. Empty
// where they do not tell the place, or it is behind a camera.
std::optional<Sim3d> FrameOfBoxes(std::span<const BoxView> views, const Camera& camera);

// The ellipsoid of a landmark from its boxes:
//  1. Each box edge that shows where the object ends spans a plane pi = P^T l; the dual quadric with the
//     least squared pi^T Q* pi, all in a frame about the object's place and of its size.
//  2. Where that is an ellipsoid: centre, rotation and half axes so that the boxes of the visible parts agree
//     with the detected ones, by Levenberg-Marquardt. Edges cut off by the image count, as in the paper;
//     edges behind another box do not. Loss and standard deviation of an edge are those of the joint
//     refinement.
// Empty where the boxes do not determine a quadric (fewer than three views, or views from one place or along
// one line) or where the result is no bounded ellipsoid in front of the cameras. Commutes with similarities
// of the map frame.
std::optional<PosedSuperquadric> EstimateDualQuadric(std::span<const BoxView> views, const Camera& camera,
                                                     const ObjectOptions& options);

}  // namespace sqslam
