#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

inline constexpr double kMinMatchIou = 0.1;

// A mapped object and its matched ground-truth object (indices into the given lists); lengths in the unit of
// the ground truth.
struct ObjectMatch {
  int mapped = 0;
  int truth = 0;
  double iou = 0.0;            // 3D
  double iou_ellipsoid = 0.0;  // of the nearest ellipsoid, as of `run --representation ellipsoid`
  double center_error = 0.0;
  double size_error = 0.0;     // mean over the axes of |full size - true full size|, axes paired by direction
  double tilt_error = 0.0;     // angle between the z axes, radians
  double yaw_error = 0.0;      // about the true z, modulo a quarter turn, radians; 0 for round cross-sections
  double footprint_iou = 0.0;  // overlap of the outlines seen along the true z (footprint.h)
  bool label_agrees = false;
};

// Returns true if the solid is so thin that its footprint says more than its 3D IoU: its smallest half size
// is less than 15 mm or 5 % of the largest.
bool IsThin(const Solid& solid);

// Returns the share of the mapped volume inside the truth, for two solids with this 3D IoU.
double ShareInside(const Solid& mapped, const Solid& truth, double iou);

// Another mapped object on a ground-truth object that has a better match.
struct ObjectDuplicate {
  int mapped = 0;
  int truth = 0;
};

struct ObjectMatching {
  std::vector<ObjectMatch> matches;  // in the order of the ground truth
  std::vector<ObjectDuplicate> duplicates;
  std::vector<int> missed;  // ground truth without a mapped object
  std::vector<int> extra;   // mapped objects that are neither matched nor duplicates
};

// Assigns mapped to true objects one to one. Two may match by one of three criteria. Overlap alone rejects
// a 4 mm thick magazine that is mapped 4 mm too high; position alone, a big object that is seen from one
// side; and both, the back of a chair whose seat is hidden by a table. The criteria:
//  - their 3D IoU is at least min_iou; or
//  - their centres are within a quarter of the true space diagonal, and their space diagonals within a factor
//    of 3 of each other (a blob the size of the table does not match a cup on it); or
//  - their labels agree, three quarters of the mapped volume lie within the truth, and their
//    diagonals are within the same factor.
// The assignment has the largest sum of 3D IoU plus nearness (1 at the same centre, 0 at the largest
// distance) plus 0.5 for the same label: a table that reaches over the chair behind it is not the chair.
// Labels need not agree: detectors call a plastic box "cell phone".
ObjectMatching MatchObjects(const std::vector<SnapshotObject>& mapped,
                            const std::vector<GroundTruthObject>& truth, const Sim3d& S_world_map,
                            double min_iou = kMinMatchIou);

// Returns the overlap of the outlines of two solids seen along `up` (unit vector in their common frame), in
// [0, 1]: intersection over union of their orthographic projections. This is informative for a magazine 4 mm
// thick, whose 3D IoU is zero as soon as it is mapped 4 mm too high. Uses polygons of 360 support points
// each, so that areas of round outlines are exact to 0.005 %. Returns 0 if a size is not positive and finite.
double FootprintIoU(const Solid& a, const Solid& b, const Eigen::Vector3d& up);

}  // namespace sqslam
