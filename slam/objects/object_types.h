#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/statistical_tests.h"

namespace sqslam {

using NamedPoints = std::vector<std::pair<std::int64_t, Eigen::Vector3d>>;  // id and position, map frame

// A feature of the current frame that is matched to a map point.
struct TrackedPoint {
  std::int64_t point_id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // distorted px
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
};

// Input of the object pipeline from one tracked frame.
struct ObjectFrame {
  std::int64_t frame_index = 0;
  Rigid3d T_map_camera;
  Camera camera;
  std::vector<Detection> detections;
  std::vector<TrackedPoint> points;
  cv::Mat gray;  // 8UC1, distorted as recorded; empty: no lines
  // Corrects a box for the rolling shutter, given the depth of the object (0: unknown). Empty: no correction.
  std::function<Box2d(const Box2d& box, double depth)> box_at_once = {};
};

// Line segment in the image, undistorted px.
struct LineSegment {
  Eigen::Vector2d a = Eigen::Vector2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();

  double Length() const { return (b - a).norm(); }

  static void VisitState(auto& self, auto&& visit) { visit(self.a, self.b); }
};

// An angle about the map's z axis, modulo 90 degrees, with its weight.
struct YawEstimate {
  double yaw = 0.0;      // radians, in [-pi/4, pi/4)
  double quality = 0.0;  // > 0, a weight
};

// One box in one frame, sent from the tracking thread to the mapping thread.
struct ObjectObservation {
  int object_id = 0;  // landmark that it was associated with; -1: none
  std::int64_t frame_index = 0;
  int detection_index = 0;  // into ObjectFrame::detections
  Detection detection;
  std::array<bool, 4> edge_free{};  // left, top, right, bottom: neither cut off nor hidden by another box
  Rigid3d T_map_camera;
  std::vector<std::int64_t> point_ids;            // in the box, after the depth gate
  std::vector<std::int64_t> reprojected_outside;  // points of the object that fall outside the box
  std::optional<Eigen::Vector3d> centroid;  // of point_ids, map frame; empty if there are too few points
  std::optional<YawEstimate> yaw;           // from the lines of this frame
  std::vector<LineSegment> lines;           // within the box; empty in most frames
  cv::Mat gray;  // the frame, 8UC1, distorted as recorded; only for quadrics from a single view
};

// State of a landmark in the mapping thread.
struct ObjectLandmarkView {
  int id = 0;
  std::string label;
  int observations = 0;
  NamedPoints points;      // inliers
  bool estimated = false;  // the superquadric is valid
  bool shown = false;      // good enough to be part of the object map
  bool on_floor = false;   // by its class
  PosedSuperquadric superquadric;
  PosedSuperquadric visible;     // its part that the boxes show
  std::vector<SolidPart> parts;  // of which that consists; empty: one solid
  PointStatistics centroids;
};

// Outcome of outlier removal for a map point, over all shown objects.
struct PointEvidence {
  int object_id = -1;    // object that it belongs to; -1: none
  int rejected_by = -1;  // object that rejected it (of several the one with most sightings); -1: none
  double anomaly = 0.0;  // isolation score by its object, or else by the rejecting one; 0: none
};

// The landmarks as the mapping thread publishes them to the tracking thread. Immutable once published.
struct ObjectMapView {
  std::int64_t version = 0;  // grows with every change
  bool upright = false;      // the map's z axis points up
  std::vector<ObjectLandmarkView> landmarks;
  std::vector<std::pair<int, int>> merges;  // old id -> surviving id, all merges so far, in order
  std::vector<int> deleted;                 // all deletions so far, in order

  // Exclusive upper bound of all ids ever assigned.
  int IdBound() const {
    int bound = 0;
    for (const ObjectLandmarkView& landmark : landmarks) {
      bound = std::max(bound, landmark.id + 1);
    }
    for (const auto& [merged, kept] : merges) {
      bound = std::max(bound, merged + 1);
    }
    for (const int id : deleted) {
      bound = std::max(bound, id + 1);
    }
    return bound;
  }
};

// Position of a map point. Follows fusions (the id is updated); nullopt if the point was culled.
using PointLookup = std::function<std::optional<Eigen::Vector3d>(std::int64_t& point_id)>;

// Newest estimate of the pose of a past frame (T_map_camera); nullopt: keep what was known.
using PoseLookup = std::function<std::optional<Rigid3d>(std::int64_t frame_index)>;

// Motion of a frame, and of what was seen from it, in a non-rigid map correction: p_new = S_new_old * p_old.
using MotionLookup = std::function<Sim3d(std::int64_t frame_index)>;

}  // namespace sqslam
