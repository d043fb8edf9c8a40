#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_types.h"
#include "slam/objects/t_test.h"

namespace sqslam {

// A landmark as the tracking thread remembers it between frames.
struct SeenLandmark {
  LabelVotes labels;
  Box2d last_box;
  Box2d box_velocity;  // per frame
  std::int64_t last_frame = -1;
  int observations = 0;
  std::unordered_set<std::int64_t> point_ids;
  PointStatistics centroids;
  std::vector<Eigen::Vector3d> cloud;        // map frame; only kept for the rank-sum test
  const ObjectLandmarkView* view = nullptr;  // of the mapping thread, where it knows the landmark

  // By constant velocity in the image, distorted px.
  Box2d PredictedBox(std::int64_t frame_index) const;
  void SeeBox(const Box2d& box, std::int64_t frame_index);
  void Absorb(SeenLandmark&& other);  // the two are one object
};

}  // namespace sqslam
