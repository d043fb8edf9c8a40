#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/util/run_counters.h"
#include "slam/util/to_vector.h"

namespace sqslam {

struct SnapshotKeyframe {
  std::int64_t id = 0;
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  Rigid3d T_map_camera;

  static void VisitState(auto& self, auto&& visit) {
    visit(self.id, self.frame_index, self.timestamp, self.T_map_camera);
  }
};

// Two keyframes that see the same map points.
struct SnapshotCovisibility {
  std::int64_t first = 0;  // ids of keyframes of the snapshot, first < second
  std::int64_t second = 0;
  std::int32_t points = 0;  // that both see

  static void VisitState(auto& self, auto&& visit) { visit(self.first, self.second, self.points); }
};

struct SnapshotPoint {
  Eigen::Vector3f p_map = Eigen::Vector3f::Zero();
  std::array<std::uint8_t, 3> rgb{};
  std::int32_t object_id = -1;  // -1: belongs to no object
  // Isolation score in the last estimate of the point's object, or of the object that rejected it, in [0, 1]
  // in steps of 1/256; 0 if it has none.
  float anomaly = 0.0F;
  std::int32_t rejected_by = -1;  // object that removed the point as an outlier; -1: none
};

// Quality of an object's fit to the data.
struct ObjectFit {
  double box_agreement = 0.0;  // mean IoU of the projected object and the detector's boxes, in [0, 1]
  double point_rms = 0.0;      // radial distance of the object's points to its surface, map units
  // In [0, 1], approximately the expected 3D IoU (docs/evaluation.md)
  double reliability = 1.0;
  // Covariance of centre (map frame), half sizes, yaw, e1 and e2, in this order: the inverse Hessian of the
  // cost, with box edges counted by the information that the run shows them to have, and with independent
  // errors of points. Zero if the object was not refined.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
};

struct SnapshotObject {
  std::int32_t id = 0;
  std::string label;
  double score = 0.0;    // mean detector score of the observations that carry the label
  int observations = 0;  // frames in which a box was associated with the object
  int points = 0;        // map points of the object after outlier removal
  double yaw = 0.0;      // radians, about the map's z axis
  PosedSuperquadric superquadric;
  ObjectFit fit;
  std::string name;  // given by a user; empty: none. Not recorded: it comes from edits of the map
  // Parts of the hull, `superquadric`; empty: one solid. Recorded beside the snapshots (object_parts.h)
  std::vector<SolidPart> parts;

  static void VisitState(auto& self, auto&& visit) {
    visit(self.id, self.label, self.score, self.observations, self.points, self.yaw, self.superquadric,
          self.fit.box_agreement, self.fit.point_rms, self.fit.reliability);
    for (int i = 0; i < 9; ++i) {
      for (int j = 0; j < 9; ++j) {
        visit(self.fit.covariance(i, j));
      }
    }
  }
};

// Returns the solids that the object consists of, map frame: its parts, or its hull if it has none.
inline std::vector<PosedSuperquadric> SolidsOf(const SnapshotObject& object) {
  if (object.parts.empty()) {
    return {object.superquadric};
  }
  return ToVector(object.parts, [&](const SolidPart& part) { return PlacedIn(object.superquadric, part); });
}

// Returns the object's name, or its label if it has none.
inline const std::string& ShownName(const SnapshotObject& object) {
  return object.name.empty() ? object.label : object.name;
}

// Returns "potted plant" for "potted_plant".
inline std::string ReadableLabel(std::string label) {
  std::ranges::replace(label, '_', ' ');
  return label;
}

// Returns false for an object that is more likely wrong than right: drawn faintly and counted separately.
inline bool IsReliable(const SnapshotObject& object) {
  constexpr double kMinReliability = 0.4;
  return object.fit.reliability >= kMinReliability;
}

struct SnapshotDetection {
  Detection detection;
  std::int32_t object_id = -1;  // the object it was associated with, or -1

  static void VisitState(auto& self, auto&& visit) {
    visit(self.detection.label, self.detection.score, self.detection.box, self.object_id);
  }
};

// State of the run at the time of a snapshot.
struct SnapshotProgress {
  int tracked_points = 0;    // map points tracked in the frame; 0 while tracking is lost
  double tracking_ms = 0.0;  // mean per frame since the last snapshot; 0: not measured (deterministic runs)
  double mapping_ms = 0.0;   // time of the mapping step that made the snapshot; 0: not measured
  RunCounters counters;      // so far; a recording keeps loops and merges only

  static void VisitState(auto& self, auto&& visit) {
    visit(self.tracked_points, self.tracking_ms, self.mapping_ms, self.counters.loops, self.counters.merges);
  }
};

// An immutable copy of the map at one moment, in the map frame (z up once gravity is known). A value:
// consumers (recorder, renderer, report) may hold it for any time; it never changes.
struct MapSnapshot {
  std::int64_t sequence_number = 0;  // 0, 1, 2, ... in the order of publication
  // The newest frame whose boxes are known: with an in-process detector, some frames behind the newest
  // tracked frame.
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds, of that frame
  std::string image_path;  // of that frame; empty if there is none (camera)
  Camera camera;
  std::optional<Rigid3d> T_map_camera;      // empty while tracking is lost
  std::vector<SnapshotKeyframe> keyframes;  // by time
  std::vector<SnapshotPoint> points;
  std::vector<SnapshotObject> objects;
  std::vector<SnapshotDetection> detections;  // boxes of the frame
  bool gravity_known = false;
  std::optional<double> support_height;      // z of the main support plane (desk or floor), map units
  std::optional<SnapshotProgress> progress;  // empty in maps that no run published, such as merged ones
  // Lengths are in metres. Not recorded: readers of a recording with a MapScale set it.
  bool metric = false;
  // Each pair of covisible keyframes, once
  std::vector<SnapshotCovisibility> covisibility;
};

inline std::vector<Eigen::Vector3d> PositionsOf(const MapSnapshot& map) {
  return ToVector(map.points,
                  [](const SnapshotPoint& point) -> Eigen::Vector3d { return point.p_map.cast<double>(); });
}

// Returns the unit of the snapshot's lengths, in words.
inline const char* UnitOf(const MapSnapshot& map) { return map.metric ? "m" : "map units"; }

using MapSnapshotPtr = std::shared_ptr<const MapSnapshot>;

}  // namespace sqslam
