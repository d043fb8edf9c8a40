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

// Parts that an association method is made of.
//
// clang-format off
// | method        | in the next frames      | after a gap                           | merging        |
// | ------------- | ----------------------- | ------------------------------------- | -------------- |
// | full          | box, projection, points | projection, points, one-sample t-test | t-test, volume |
// | iou           | box                     | nothing: the object begins anew       | none           |
// | iou+points    | box, points             | points                                | none           |
// | iou+ttest     | box                     | one-sample t-test                     | t-test         |
// | nonparametric | rank-sum test           | rank-sum test                         | none           |
// | ensemble      | box                     | rank-sum test, else one-sample t-test | t-test         |
// clang-format on
//
// "box" is the overlap with the box predicted from the last frames, "projection" that with the outline of the
// landmark's superquadric, "points" the share of map points in common, "t-test" the two-sample test and
// "volume" the overlap of superquadrics. Only "full" gives a box of another label to a landmark. `full` is
// the paper's association plus what the superquadrics themselves tell; iou, iou+points and iou+ttest are its
// ablations. nonparametric: Iqbal and Gans, "Localization of Classified Objects in SLAM using Nonparametric
// Statistics and Clustering", IROS 2018 (the depth gate in the place of their clustering); ensemble: Wu et
// al., "EAO-SLAM", IROS 2020.
struct AssociationParts {
  bool predicted_box = false;
  bool projection = false;
  bool points = false;
  bool one_sample = false;
  bool rank_sum = false;
  bool other_labels = false;
  bool merge_by_test = false;
  bool merge_by_volume = false;
};

AssociationParts PartsOf(const AssociationOptions& options);

// The test of options.t_test.
MeanTest MeanTestOf(const AssociationOptions& options);

// Assigns boxes to landmarks (section "Data Association"): returns for each box the index into `landmarks`,
// or -1; one landmark a box and one box a landmark. First between consecutive frames (overlap with the
// predicted box, shared map points), then by geometry (one-sample t-test on the centroid, projected
// landmark). Both steps are solved as optimal assignments, so that the result doesn't depend on the order of
// the boxes.
std::vector<int> Associate(const std::vector<BoxCandidate>& boxes,
                           const std::vector<const KnownLandmark*>& landmarks,
                           const AssociationOptions& options);

// Share of the box's points that are the landmark's, in [0, 1]; 0 below options.min_shared_points.
double SharedPoints(const BoxCandidate& box, const KnownLandmark& landmark,
                    const AssociationOptions& options);

}  // namespace sqslam
