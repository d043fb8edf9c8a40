#pragma once

#include <span>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"

namespace sqslam {

// Usual standard deviation of a box edge, px. `size`: of the box across the edge, px.
double EdgeSigma(double size, const RefinementOptions& options);

// A fitted object with some of its views, in the order of their frames.
struct FittedViews {
  PosedSuperquadric hull;
  std::vector<SolidPart> parts;  // empty: the hull
  std::vector<BoxView> views;
};

// Measures how much a run's box edges tell, by the free ones of the objects: the information of an edge over
// that of one whose error is independent and has the usual standard deviation, at most 1. Errors are taken
// about the mean of their side of the object, whose bias the fit knows. Where they repeat from view to view,
// an edge adds (1 - r) / (1 + r), with the correlation r of successive ones (a first-order autoregressive
// process).
double EdgeInformation(std::span<const FittedViews> objects, const Camera& camera,
                       const RefinementOptions& options);

}  // namespace sqslam
