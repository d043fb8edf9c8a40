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

namespace sqslam {

// A landmark as the tracking thread remembers it from frame to frame.
struct KnownLandmark {
  LabelVotes labels;
  Box2d last_box;
  Box2d box_velocity;  // per frame
  std::int64_t last_frame = -1;
  std::int64_t lines_frame =
      -1;              // frame of the last line extraction; at first that before the first sighting
  int line_views = 0;  // frames in which its lines were extracted
  std::unordered_set<std::int64_t> point_ids;
  PointStatistics centroids;
  std::vector<Eigen::Vector3d> cloud;        // map frame; only kept for the rank-sum test
  const ObjectLandmarkView* view = nullptr;  // from the mapping thread; null if not known there

  // In the current frame, distorted px.
  std::optional<Box2d> predicted_box;  // by constant velocity in the image; only if seen recently
  std::optional<Box2d> projected_box;  // of the superquadric, clipped to the image

  bool IsEstimated() const { return view != nullptr && view->estimated; }
  double Radius() const;  // largest half size, map units; 0: unknown
  Box2d PredictedBox(std::int64_t frame_index) const;
  void SeeBox(const Box2d& box, std::int64_t frame_index);
  void Absorb(KnownLandmark&& other);  // merges a duplicate of this object
};

// Returns options.rules, or else those of the method.
AssociationRules RulesOf(const AssociationOptions& options);

// Assigns boxes to landmarks (section "Data Association"): returns for each box the index into `landmarks`,
// or -1; each landmark gets at most one box. The first step associates between consecutive frames (overlap
// with the predicted box, shared map points), the second by geometry (one-sample t-test on the centroid,
// projected landmark). Each is an optimal assignment, independent of the order of the boxes.
std::vector<int> Associate(const std::vector<BoxCandidate>& boxes,
                           const std::vector<const KnownLandmark*>& landmarks,
                           const AssociationOptions& options);

}  // namespace sqslam
