#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Returns the outline of a superquadric in the image: a convex polygon in undistorted pixels, in order, that
// deviates from the true curve by at most `tolerance` pixels. If the solid reaches behind the camera or out
// of the image, only the part within `margin` pixels around the image; empty if none of it is visible there,
// or if the camera is inside.
//
// The curve is the image of the contour generator, the surface points whose tangent plane contains the camera
// centre c: n . p = n . c. Scaled such that n . p = 1, the normals lie on the dual superquadric (exponents 2
// - e), and n . c = 1 cuts it in a plane: a convex curve, which rays in the plane from a point inside meet
// once. Between two of its points the curve in the image is enclosed by their chord and their tangents, and
// this triangle is compared with the tolerance.
std::vector<Eigen::Vector2d> Silhouette(const PosedSuperquadric& solid, const Camera& camera,
                                        const Rigid3d& T_map_camera, double tolerance = 0.05,
                                        double margin = 16.0);

// Distorts the outline, with chords of at most `step` pixels, since straight lines become curved.
std::vector<Eigen::Vector2d> DistortedOutline(const std::vector<Eigen::Vector2d>& outline,
                                              const Camera& camera, double step = 8.0);

}  // namespace sqslam
