#pragma once

#include "slam/objects/object_options.h"

namespace sqslam {

// Returns the options that make the object pipeline follow the paper's text, for `objects.method: paper`;
// other methods keep theirs. No other code knows the method.
//
// Section IV-A. Reprojection: a point outside one of the object's boxes is removed until the next box that
// contains it; no margin, no vote. No depth gate. Extended isolation forest from four points on.
//
// IV-B. The centre is the centroid of the points. Yaw from the lines in the box, in every frame: 18 angles,
// the most matches below 5 degrees, least squares of the angles with axes projected at the centroid
// (LineFit::kLeastSquares); else the principal axis of the points, even if these are nearly round. Unweighted
// running mean over frames (Eq. 9), modulo 90 degrees on the circle.
//
// IV-C. Half sizes from the extreme points (Eq. 10). Exponents by radial distance and weights (Eq. 11, 12)
// from the best sample: no prior, no robust loss. Camera poses and points are constant unless
// mapping.joint_objects.mode includes them (Eq. 13). That is off, because with all of Lambda free a cloud
// seen from one side inflates the half sizes without bound.
//
// IV-D. Between frames (at most objects.association.inter_frame_gap apart) same label, overlap of the two
// boxes (no prediction), and shared points; else the one-sample t-test with sqrt(n) (Eq. 14) on the
// centroids. Landmarks of a label merge by the two-sample t-test (Eq. 15, 16) and by nothing else.
//
// V-A. Quadrics have the pose and size of the superquadric: --representation ellipsoid.
//
// The paper leaves open: thresholds, which of several candidates a box takes (here the optimal assignment),
// what starts an object (here five points), and the up direction, which is estimated from the map.
ObjectOptions OptionsOfMethod(ObjectOptions options);

}  // namespace sqslam
