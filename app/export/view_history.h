#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "slam/snapshot/recording.h"

namespace sqslam::app {

// What the states of a run tell that the finished map does not.
struct ViewHistory {
  std::map<std::int32_t, double> first_seen;  // object id: time of the first state that holds it, seconds
  std::map<std::int64_t, std::set<std::int32_t>> seen_in;  // frame: ids of objects that had a box in it
};

ViewHistory ReadHistory(const RecordingReader& reader);

// For each point the first keyframe that has it in view and not much farther than what it mostly looks at;
// the last one for points that none has. Numbers of keyframes of the map.
std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points);

}  // namespace sqslam::app
