#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/detection.h"

namespace sqslam {

struct SequenceFrame {
  double timestamp = 0.0;            // seconds, rising
  std::filesystem::path image_path;  // empty for a video
  std::vector<Detection> detections;
};

// An image sequence that has been listed but not decoded.
struct Sequence {
  std::filesystem::path path;
  std::filesystem::path video_path;  // empty where the frames are files
  Camera camera;
  std::vector<SequenceFrame> frames;
  bool has_detections = false;
};

enum class SequenceFormat { kAuto, kTum, kImages, kVideo };

struct SequenceRequest {
  std::filesystem::path path;
  SequenceFormat format = SequenceFormat::kAuto;
  std::filesystem::path camera_file;  // empty: camera.yaml of the sequence folder
  std::filesystem::path
      detections;  // boxes.txt or folder; empty: boxes.txt of the sequence folder if it is there
};

// Lists the frames of a folder with rgb.txt, of a folder of images (sorted by name, timestamps from the
// camera's fps), or of a video file. Ground truth is never looked at. Throws InputError that names file, line
// and what was expected: broken lines, timestamps that do not rise, a broken or missing camera, no frame at
// all. Images are not opened here (FrameSource skips those that cannot be used).
Sequence OpenSequence(const SequenceRequest& request);

}  // namespace sqslam
