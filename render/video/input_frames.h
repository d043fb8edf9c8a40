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
