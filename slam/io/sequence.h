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

enum class SequenceFormat { kAuto, kTum, kIclNuim, kScenesV2, k7Scenes, kImages, kVideo };

// An image sequence that has been listed but not decoded.
struct Sequence {
  std::filesystem::path path;
  std::filesystem::path video_path;  // empty where the frames are files
  SequenceFormat format = SequenceFormat::kImages;
  Camera camera;
  std::vector<SequenceFrame> frames;
  bool has_detections = false;
};

struct SequenceRequest {
  std::filesystem::path path;
  SequenceFormat format = SequenceFormat::kAuto;  // kAuto: by the names in the folder (DetectFormat)
  std::string
      camera;  // calibration file or preset; empty: camera.yaml of the folder, or the dataset's preset
  std::filesystem::path
      detections;  // boxes.txt or folder; empty: boxes.txt of the sequence folder if it is there
};

// Lists the frames of a folder with rgb.txt, of one of the dataset layouts (dataset_layouts.h), of a folder
// of images (names in numeric order, timestamps from the camera's fps; depth images are left out), or of a
// video file (timestamps from the video's rate). Ground truth is never looked at. Throws InputError that
// names file, line and what was expected: broken lines, timestamps that do not rise, a broken or missing
// camera, a video of another size, no frame at all; UsageError for an unknown camera preset. Images are not
// opened here (FrameSource skips those that cannot be used).
Sequence OpenSequence(const SequenceRequest& request);

}  // namespace sqslam
