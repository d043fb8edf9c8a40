#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Conditions under which a mapped object matches a ground-truth object. There are three, because overlap
// alone would reject a magazine 4 mm thick that is mapped 4 mm too high, position alone a big object that is
// seen from one side, and both the back of a chair whose seat is hidden by a table:
//  - 3D IoU of at least min_iou; or
//  - centre distance of at most max_center_distance times half the ground truth's space diagonal, and space
//    diagonals within a factor of max_size_ratio of each other (a blob the size of the table does not match a
//    cup on it); or
//  - the same label, at least min_part_inside of the mapped volume within the ground truth, and such
//    diagonals.
// Otherwise labels only decide between several candidates: detectors call a plastic box "cell phone".
struct MatchingOptions {
  double min_iou = 0.1;              // 3D IoU that alone is enough for a match
  double max_center_distance = 0.5;  // centre distance over half the space diagonal of the ground truth
  double max_size_ratio = 3.0;       // maximum ratio of the space diagonals, either way
  double min_part_inside = 0.75;     // share of the mapped volume in the truth that makes it a visible part

  void VisitFields(auto&& visit) {
    visit("min_iou", min_iou, 0.0, 1.0);
    visit("max_center_distance", max_center_distance, 0.0, 10.0);
    visit("max_size_ratio", max_size_ratio, 1.0, 100.0);
    visit("min_part_inside", min_part_inside, 0.0, 1.0);
  }
};

// A mapped object and its matched ground-truth object (indices into the given lists); lengths in the unit of
// the ground truth.
struct ObjectMatch {
  int mapped = 0;
  int truth = 0;
  double iou = 0.0;            // 3D
  double iou_ellipsoid = 0.0;  // the same with e1 = e2 = 1
  double center_error = 0.0;
  double size_error = 0.0;     // mean over the axes of |full size - true full size|, axes paired by direction
  double tilt_error = 0.0;     // angle between the z axes, radians
  double yaw_error = 0.0;      // about the true z, modulo a quarter turn, radians; 0 for round cross-sections
  double footprint_iou = 0.0;  // overlap of the outlines seen along the true z (footprint.h)
  bool label_agrees = false;
};

// True if the solid is too thin for its 3D IoU to say much, so that the footprint is of interest: the
// smallest half size is less than 15 mm or 5 % of the largest.
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

// Optimal one-to-one assignment by 3D IoU plus nearness (1 at the same centre, 0 at max_center_distance) plus
// 0.5 for the same label: a table that reaches over the chair behind it is not the chair.
ObjectMatching MatchObjects(const std::vector<SnapshotObject>& mapped,
                            const std::vector<GroundTruthObject>& truth, const Sim3d& S_world_map,
                            const MatchingOptions& options);

// Returns the overlap of the outlines of two solids seen along `up` (unit vector in their common frame), in
// [0, 1]: intersection over union of their orthographic projections. This is informative for a magazine 4 mm
// thick, whose 3D IoU is zero as soon as it is mapped 4 mm too high. Uses polygons of 360 support points
// each, so that areas of round outlines are exact to 0.005 %. 0 if a size is not positive and finite.
double FootprintIoU(const Solid& a, const Solid& b, const Eigen::Vector3d& up);

}  // namespace sqslam
