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

// Section "Data Association": which landmark each box belongs to (index into `landmarks`, or -1), one
// landmark a box and one box a landmark. First between consecutive frames (overlap with the predicted box,
// shared map points), then by geometry (one-sample t-test on the centroid, projected landmark). Both steps
// are solved as optimal assignments, so that the result doesn't depend on the order of the boxes.
std::vector<int> Associate(const std::vector<MeasuredBox>& boxes, const std::vector<KnownLandmark>& landmarks,
                           const AssociationOptions& options);

// Share of the box's points that are the landmark's, in [0, 1]; 0 below options.min_shared_points.
double SharedPoints(const MeasuredBox& box, const KnownLandmark& landmark, const AssociationOptions& options);

}  // namespace sqslam
