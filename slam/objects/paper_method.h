#pragma once

#include "slam/objects/object_options.h"

namespace sqslam {

// Options that make the object pipeline what the paper's text says, for `objects.method: paper`. Steps that
// the options cannot say ask for the method themselves. Other methods keep their options.
//
// Section IV-A. Reprojection: one box of the object that a point falls outside removes it, the next that
// holds it takes it in again; no margin, no vote. No depth gate. Extended isolation forest from four points
// on.
//
// IV-B. The centre is the centroid of the points. Yaw from the lines in the box, in every frame: 18 angles,
// the most matches below 5 degrees, least squares of the angles with axes projected at the centroid
// (LineFit::kPaper); else the principal axis of the points, however round they are. Running mean of all
// frames alike (Eq. 9), modulo 90 degrees on the circle.
//
// IV-C. Half sizes from the extreme points (Eq. 10). Exponents by radial distance and weights (Eq. 11, 12)
// from the best sample: no prior, no robust loss. Camera poses and points are held;
// mapping.joint_objects.mode lets them take part (Eq. 13). That is off, because with all of Lambda free a
// cloud seen from one side pulls the half sizes out without bounds.
//
// IV-D. Between frames (at most objects.association.inter_frame_gap apart) same label, overlap of the two
// boxes as they were, and shared points; else the one-sample t-test with sqrt(n) (Eq. 14), of centroids as
// they come. Landmarks of a label merge by the two-sample t-test (Eq. 15, 16) and by nothing else. RulesOf()
// has these.
//
// V-A. Quadrics have the pose and size of the superquadric: --representation ellipsoid.
//
// The paper leaves open: thresholds, which of several candidates a box takes (here the best assignment of
// all), what starts an object (here five points), and up, which is found in the map.
ObjectOptions OptionsOfMethod(ObjectOptions options);

}  // namespace sqslam
