#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// The outline of a superquadric in the image: a convex polygon in undistorted pixels, in order around it,
// that leaves the true curve nowhere by more than `tolerance` pixels. Of a solid that reaches behind the
// camera or out of the picture, the part within `margin` pixels around the picture; empty where nothing of it
// is seen there, or where the camera is inside of it.
//
// The curve is the image of the contour generator, the surface points whose tangent plane holds the camera
// centre c: n . p = n . c. Scaled such that n . p = 1, the normals lie on the dual superquadric (exponents
// 2 - e), and n . c = 1 cuts that along a plane: a convex curve without holes, which rays in the plane reach
// from a point inside. Between two of its points the curve of the image is enclosed by their chord and their
// tangents, and that triangle is what is compared with the tolerance.
std::vector<Eigen::Vector2d> Silhouette(const PosedSuperquadric& solid, const Camera& camera,
                                        const Rigid3d& T_map_camera, double tolerance = 0.05,
                                        double margin = 16.0);

// The same outline as the lens shows it, with distortion: chords no longer than `step` pixels, since straight
// lines are none any more.
std::vector<Eigen::Vector2d> DistortedOutline(const std::vector<Eigen::Vector2d>& outline,
                                              const Camera& camera, double step = 8.0);

}  // namespace sqslam
