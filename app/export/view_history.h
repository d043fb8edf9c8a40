#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "slam/snapshot/recording.h"

namespace sqslam::app {

// Facts about a run that its recorded states contain but the finished map does not.
struct ViewHistory {
  std::map<std::int32_t, double> first_seen;  // object id -> time of the first state that holds it, seconds
  std::map<std::int64_t, std::set<std::int32_t>> seen_in;  // frame -> ids of objects with a box in it
  std::map<std::int64_t, std::string> image_files;         // frame -> image file, if it had one
};

// The outline of an object over the image of a keyframe.
struct SeenOutline {
  std::size_t keyframe = 0;  // indices of keyframe and object in the map
  std::size_t object = 0;
  bool detected = false;           // the object has a box in this keyframe
  double share = 0.0;              // share of the image that it covers
  bool whole = false;              // entirely inside the image
  std::vector<cv::Point> polygon;  // px, with lens distortion
};

// Returns the outlines of all objects in all keyframes, nearest object first within a keyframe. They are
// simplified with an error of at most `tolerance` px.
std::vector<SeenOutline> FindOutlines(const MapSnapshot& map, const ViewHistory& history, double tolerance);

// Reads every state of the recording. Slow: call it once and reuse the result.
ViewHistory ReadHistory(const RecordingReader& reader);

// Returns, for each point, the index of the first keyframe that has it in view, no farther than 2.5 times the
// median depth of that view; the last keyframe if there is none.
std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points);

}  // namespace sqslam::app
