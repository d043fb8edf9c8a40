#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/viewer/model/snapshot_pass.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::viewer {

// An object at one snapshot.
struct ObjectSample {
  int snapshot = 0;  // its index in the recording
  std::int64_t frame_index = 0;
  int observations = 0;  // until then
  int points = 0;
  // Radians, without jumps: a solid turned by a quarter with its x and y axes swapped is the same, and of
  // these descriptions samples have the one nearest to the sample after; the newest has the map's own.
  double yaw = 0.0;
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();  // map units of that snapshot, axes as yaw has them
  double e1 = 0.0;
  double e2 = 0.0;
  double residual = 0.0;  // rms distance of its points, map units
};

struct ObjectHistory {
  std::string label;  // at the end
  std::vector<ObjectSample> samples;
};

// Histories of all objects, also of those that are gone at the end, by id. Grows snapshot by snapshot: during
// a live run by each new one, of a recording in one pass.
class ObjectHistories {
 public:
  // `snapshot` is the index of the map in the recording; the maps must come in order.
  void Add(int snapshot, const MapSnapshot& map);

  const std::map<int, ObjectHistory>& All() const { return histories_; }

 private:
  std::map<int, ObjectHistory> histories_;
};

// One pass over a recording; what had been read where it was stopped. Throws InputError on a broken one.
ObjectHistories ReadObjectHistories(const RecordingReader& recording, const PassProgress& progress = {});

}  // namespace sqslam::viewer
