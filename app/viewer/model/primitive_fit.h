#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "slam/geometry/solid_iou.h"

namespace sqslam::viewer {

struct PrimitiveFitOptions {
  bool round = true;             // cylinders get a circular cross-section
  std::optional<double> ground;  // z that the solid stands on, its top left where it is; empty: as it fits
};

struct PrimitiveFit {
  Solid solid;       // upright: only yaw is free; frame and unit of the points
  double rms = 0.0;  // distance of the points to the surface
  int points = 0;
};

// The upright solid of a kind that suits points of its surface best, even where they show only some of its
// sides: what is not seen reaches as far as the points do (or to the ground). Cuboids, cylinders and
// ellipsoids from 6 points on, superquadrics from 11. Yaw in (-45, 45] degrees, x and y axes named
// accordingly. Throws InputError for fewer points, or points that are all in one place.
PrimitiveFit FitPrimitive(std::span<const Eigen::Vector3d> points, SolidKind kind,
                          const PrimitiveFitOptions& options = {});

}  // namespace sqslam::viewer
