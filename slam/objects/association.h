#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "slam/geometry/detection.h"
#include "slam/objects/object_options.h"
#include "slam/objects/t_test.h"

namespace sqslam {

// A box as the association sees it.
struct MeasuredBox {
  Detection detection;
  std::vector<std::int64_t> point_ids;  // in the box, behind the depth gate
  std::optional<Eigen::Vector3d> centroid;
  std::vector<Eigen::Vector3d> positions;  // of point_ids, map frame; only for the rank-sum test
};

// A landmark as the association sees it. The sets belong to the caller and must outlive the call.
struct KnownLandmark {
  std::string label;
  std::int64_t frames_since_seen = 0;
  std::optional<Box2d> predicted_box;  // by its motion in the image; only if seen lately
  std::optional<Box2d> projected_box;  // of its superquadric in the current camera
  const std::unordered_set<std::int64_t>* point_ids = nullptr;
  const PointStatistics* centroids = nullptr;
  std::optional<Eigen::Vector3d> centre;                // of its superquadric, map frame
  double radius = 0.0;                                  // largest half size; 0: unknown
  const std::vector<Eigen::Vector3d>* cloud = nullptr;  // its points, map frame; only for the rank-sum test
};

// What the association methods are made of.
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

// Section "Data Association": which landmark each box belongs to (index into `landmarks`, or -1), one
// landmark a box and one box a landmark. First between consecutive frames (overlap with the predicted box,
// shared map points), then by geometry (one-sample t-test on the centroid, projected landmark). Both steps
// are solved as optimal assignments, so that the result doesn't depend on the order of the boxes.
std::vector<int> Associate(const std::vector<MeasuredBox>& boxes, const std::vector<KnownLandmark>& landmarks,
                           const AssociationOptions& options);

// Share of the box's points that are the landmark's, in [0, 1]; 0 below options.min_shared_points.
double SharedPoints(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationOptions& options);

}  // namespace sqslam
