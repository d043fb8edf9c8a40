#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/evaluation/ground_truth.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Conditions under which a mapped object counts as a ground-truth object. Three ways, because overlap alone
// would refuse a magazine 4 mm thick that is mapped 4 mm too high, position alone would refuse a big object
// that is seen from one side, and both would refuse the back of a chair whose seat is hidden by a table:
//  - 3D IoU of at least min_iou; or
//  - centre distance of at most max_center_distance times half the ground truth's space diagonal, and space
//    diagonals within a factor of max_size_ratio of each other (a blob the size of the table stands for no
//    cup on it); or
//  - the same label, at least min_part_inside of the mapped volume within the ground truth, and such
//    diagonals.
// Otherwise labels decide only between several: detectors call a plastic box "cell phone".
struct MatchingOptions {
  double min_iou = 0.1;              // 3D IoU that alone makes a match
  double max_center_distance = 0.5;  // centre distance over half the space diagonal of the ground truth
  double max_size_ratio = 3.0;       // ratio of the space diagonals, either way
  double min_part_inside = 0.75;     // share of the mapped volume that makes it a visible part of the truth

  void VisitFields(auto&& visit) {
    visit("min_iou", min_iou, 0.0, 1.0);
    visit("max_center_distance", max_center_distance, 0.0, 10.0);
    visit("max_size_ratio", max_size_ratio, 1.0, 100.0);
    visit("min_part_inside", min_part_inside, 0.0, 1.0);
  }
};

// A mapped object and the ground-truth object it stands for (indices into the given lists); lengths in the
// unit of the ground truth.
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

// Too thin for its 3D IoU to say much, so that the footprint is worth a look: the smallest half size is less
// than 15 mm or 5 % of the largest.
bool IsThin(const Solid& solid);

// Share of the mapped volume that lies within the truth, of two solids with this 3D IoU.
double ShareInside(const Solid& mapped, const Solid& truth, double iou);

// A further mapped object on a ground-truth object that a better one is matched to.
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

// Overlap of the outlines that two solids show when seen along `up` (unit vector of the solids'
// common frame), in [0, 1]: intersection over union of the areas of their orthographic shadows. What is left
// to say of a magazine 4 mm thick, whose 3D IoU is nothing as soon as it is mapped 4 mm too high.
// Polygons of 360 support points each, so that areas of round outlines are exact to 0.005 %. 0 where a size
// is not positive and finite.
double FootprintIoU(const Solid& a, const Solid& b, const Eigen::Vector3d& up);

}  // namespace sqslam
