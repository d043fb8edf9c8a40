#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Computes the bounding box of the superquadric's silhouette, undistorted px, not clipped to the image; exact
// up to the distortion. Empty if part of the object is behind the camera.
std::optional<Box2d> ProjectToBox(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera,
                                  const Camera& camera);

// Likewise of an object that consists of parts; without parts of the hull.
std::optional<Box2d> ProjectToBox(const PosedSuperquadric& hull, std::span<const SolidPart> parts,
                                  const Rigid3d& T_map_camera, const Camera& camera);

// Root mean square over the axes of sigma(half size) / half size. `covariance`: see ObjectFit.
double LogSizeSigma(const Superquadric& shape, const Eigen::Matrix<double, 9, 9>& covariance);

// Clip a box to the image in distorted and in undistorted px (see Camera::ShownBounds).
Box2d ClipToImage(const Box2d& box, const Camera& camera);
Box2d ClipToShown(const Box2d& box, const Camera& camera);

// Convert a box between distorted and undistorted px by the midpoints of its edges.
Box2d UndistortBox(const Box2d& box, const Camera& camera);
Box2d DistortBox(const Box2d& box, const Camera& camera);

// Returns the box with its edges that are not free moved outward to those of `projected`.
Box2d Continued(const Box2d& box, const std::array<bool, 4>& edge_free, const Box2d& projected);

// Left, top, right and bottom of a box (undistorted px) on the image plane at depth 1.
std::array<double, 4> NormalisedBounds(const Box2d& box, const Camera& camera);

// Computes the intersection of two superquadrics over the volume of the smaller one, in [0, 1], on a regular
// grid of `samples`^3 points (even number per axis) in the box around the smaller one.
double OverlapOfSmaller(const PosedSuperquadric& a, const PosedSuperquadric& b, int samples = 16);

// Quick frustum test of the bounding sphere: never false if a part of the object is seen and its centre is in
// front of the camera.
bool MayBeInView(const PosedSuperquadric& superquadric, const Rigid3d& T_map_camera, const Camera& camera);

// Returns the superquadric with the same top and its bottom at `height`.
PosedSuperquadric StretchedTo(PosedSuperquadric superquadric, double height);

}  // namespace sqslam
