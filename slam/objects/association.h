#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/objects/detection_filter.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/objects/statistical_tests.h"

namespace sqslam {

// A landmark as the tracking thread remembers it from frame to frame.
struct KnownLandmark {
  LabelVotes labels;
  Box2d last_box;
  Box2d box_velocity;  // per frame
  std::int64_t last_frame = -1;
  std::int64_t lines_frame = -1;  // in which its lines were looked for last, or that it was first seen in
  int line_views = 0;             // frames in which its lines were looked for
  std::unordered_set<std::int64_t> point_ids;
  PointStatistics centroids;
  std::vector<Eigen::Vector3d> cloud;        // map frame; only kept for the rank-sum test
  const ObjectLandmarkView* view = nullptr;  // of the mapping thread, where it knows the landmark

  // In the current frame, distorted px.
  std::optional<Box2d> predicted_box;  // by constant velocity in the image; only if seen lately
  std::optional<Box2d> projected_box;  // around the superquadric, within the image

  bool IsEstimated() const { return view != nullptr && view->estimated; }
  double Radius() const;  // largest half size, map units; 0: unknown
  Box2d PredictedBox(std::int64_t frame_index) const;
  void SeeBox(const Box2d& box, std::int64_t frame_index);
  void Absorb(KnownLandmark&& other);  // the two are one object
};

// Steps that the association method and the way of estimation ask for.
struct AssociationRules {
  AssociationParts parts;
  OneSampleTest one_sample = OneSampleTest::kOfSingle;
  double least_spread = 0.1;  // of centroids, standard deviation in units of the largest half size
  bool still = false;         // boxes are compared with the last one as it was, not as predicted
  bool points_later = true;   // shared points count after a gap as well
};

// Those of objects.association.method; of the paper for `objects.method: paper` with the full association.
AssociationRules RulesOf(const ObjectOptions& options);

// Assigns boxes to landmarks (section "Data Association"): returns for each box the index into `landmarks`,
// or -1; one landmark a box and one box a landmark. First between consecutive frames (overlap with the
// predicted box, shared map points), then by geometry (one-sample t-test on the centroid, projected
// landmark). Both steps are solved as optimal assignments, so that the result doesn't depend on the order of
// the boxes.
std::vector<int> Associate(const std::vector<BoxCandidate>& boxes,
                           const std::vector<const KnownLandmark*>& landmarks,
                           const AssociationOptions& options, const AssociationRules& rules);

}  // namespace sqslam
