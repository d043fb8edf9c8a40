#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>

#include "slam/io/input_images.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"

namespace sqslam {

// The frames that went into a map: their poses in the finished map and, where the sequence is still there,
// their images.
class InputFrames {
 public:
  // `map_file`: the recording, beside which trajectory.txt may lie. Poses come from that file, else from the
  // keyframes and snapshots of the recording.
  InputFrames(const RecordingReader& recording, const std::filesystem::path& map_file);

  // T_map_camera. Throws UsageError that tells which frames were tracked.
  Rigid3d PoseOf(std::int64_t frame) const;

  // 8UC3, as it was mapped (a resized one in that size). Throws InputError where it cannot be found or read.
  cv::Mat ImageOf(std::int64_t frame);

 private:
  InputImages images_;
  Camera camera_;
  PosesByFrame poses_;
  std::map<std::int64_t, std::string> files_;  // images of snapshots, by index of the frame
};

}  // namespace sqslam
