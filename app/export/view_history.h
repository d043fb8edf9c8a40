#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "slam/io/input_images.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {

// Facts that the states of a run tell and the finished map does not.
struct ViewHistory {
  std::map<std::int32_t, double> first_seen;  // object id: time of the first state that holds it, seconds
  std::map<std::int64_t, std::set<std::int32_t>> seen_in;  // frame: ids of objects that had a box in it
  std::map<std::int64_t, std::string> image_files;         // frame: image of a state, where it was in a file
};

// The outline of an object over the image of a keyframe.
struct SeenOutline {
  std::size_t keyframe = 0;  // number of the keyframe and of the object in the map
  std::size_t object = 0;
  bool detected = false;           // the object had a box there
  double share = 0.0;              // of the image that it covers
  bool whole = false;              // all of it is in the image
  std::vector<cv::Point> polygon;  // px of the camera's images, as the lens shows it
};

// Outlines of all objects in all keyframes, the nearest object of each first; `tolerance`: px by which they
// may be simpler than they are.
std::vector<SeenOutline> FindOutlines(const MapSnapshot& map, const ViewHistory& history, double tolerance);

// Reads every state, which takes long: once for all that is made of a recording.
ViewHistory ReadHistory(const RecordingReader& reader);

// The image of a frame, 8UC3; empty where it is not there any more.
cv::Mat PhotoOf(const ViewHistory& history, std::int64_t frame, InputImages& images);

// For each point the first keyframe that has it in view and not much farther than what it mostly looks at;
// the last one for points that none has. Numbers of keyframes of the map.
std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points);

}  // namespace sqslam::app
