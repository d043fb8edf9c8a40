#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>

#include "slam/geometry/rigid3.h"
#include "slam/io/input_images.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns the similarity S_target_map that aligns an earlier snapshot to a later one by their common
// keyframes: the map rotates when gravity becomes known and its scale may drift, which must not look like
// motion. The identity if they share fewer than two keyframes.
Sim3d AlignByKeyframes(const MapSnapshot& map, const MapSnapshot& target);

MapSnapshot Transformed(const Sim3d& S_target_map, const MapSnapshot& map);

// Returns `to` with camera and objects on their way there from another state of the map; `share`: of the way,
// [0, 1]. Objects that are new grow.
MapSnapshot Between(const MapSnapshot& from, const MapSnapshot& to, double share);

// The input frames of a map: their poses in the finished map and, if the sequence still exists, their images.
class InputFrames {
 public:
  // `map_file`: the recording. Poses come from trajectory.txt beside it, else from keyframes and snapshots.
  InputFrames(const RecordingReader& recording, const std::filesystem::path& map_file);

  // Returns T_map_camera. Throws UsageError that says which frames were tracked.
  Rigid3d PoseOf(std::int64_t frame) const;

  // Returns the image at the size at which it was mapped (8UC3). Throws InputError if it cannot be read.
  cv::Mat ImageOf(std::int64_t frame);

 private:
  InputImages images_;
  PosesByFrame poses_;
  std::map<std::int64_t, std::string> files_;  // images of snapshots, by frame index
};

}  // namespace sqslam
